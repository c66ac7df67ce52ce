# The linker keeps one copy of an inline function that several sources define. If that copy came from a kernel that was
# compiled for AVX2, the whole program would need AVX2. So those objects may define nothing that can be merged, but
# what carries the name of its own instruction set.
#   cmake -D BUILD=<build folder> -D NM=<nm> -P weak_symbols_test.cmake
cmake_minimum_required(VERSION 3.22)
file(GLOB_RECURSE objects ${BUILD}/src/*.o)
list(FILTER objects INCLUDE REGEX "_avx(2|512)\\.dir/")
list(LENGTH objects count)
if(count EQUAL 0)
  message(FATAL_ERROR "no kernels found below ${BUILD}/src")
endif()
set(found "")
foreach(object IN LISTS objects)
  execute_process(COMMAND ${NM} --demangle --defined-only ${object} OUTPUT_VARIABLE symbols COMMAND_ERROR_IS_FATAL ANY)
  string(REGEX MATCHALL "[^\n]* [WVu] [^\n]*" mergeable "${symbols}")
  list(FILTER mergeable EXCLUDE REGEX "avx2|avx512| DW\\.ref\\.")  # DW.ref.*: data that unwinding needs, no code
  if(mergeable)
    list(JOIN mergeable "\n  " mergeable)
    string(APPEND found "${object}:\n  ${mergeable}\n")
  endif()
endforeach()
if(found)
  message(FATAL_ERROR "inline functions that the linker may use for everybody:\n${found}")
endif()
message("${count} kernel objects define nothing that can be merged")
