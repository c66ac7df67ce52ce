# How our own code is compiled: warnings, sanitizers, and the kernels that exist once per instruction set.

add_library(pade_warnings INTERFACE)
target_compile_options(pade_warnings INTERFACE -Wall -Wextra -Wpedantic -Wconversion -Wshadow)
# Kernels join conditions without branches.
target_compile_options(pade_warnings INTERFACE
  $<$<CXX_COMPILER_ID:Clang>:-Wno-bitwise-instead-of-logical>
  $<$<CXX_COMPILER_ID:Clang>:-Wno-bitwise-conditional-parentheses>)
if(PADE_WERROR)
  target_compile_options(pade_warnings INTERFACE -Werror)
endif()

# Contraction to fused multiply-add would make the result depend on the machine; see docs/design.md.
add_compile_options(-ffp-contract=off)
# Eigen fuses by itself on aarch64, where this says that it can. (The notes are of what changed in GCC 10.)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "aarch64|arm64")
  add_compile_options(-U__ARM_FEATURE_FMA $<$<CXX_COMPILER_ID:GNU>:-Wno-psabi>)
endif()

if(PADE_SANITIZE)
  add_compile_options(-fsanitize=${PADE_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${PADE_SANITIZE})
  # Their dlopen is not the program's, so that only the older kind of run path counts for it.
  add_link_options(-Wl,--disable-new-dtags)
  # What the sanitizers add hides from g++ that standard containers are initialised (seen in std::regex).
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    add_compile_options(-Wno-maybe-uninitialized)
  endif()
endif()

# Headers that most sources of a kind include, read by the compiler once. ccache keeps nothing of a source that uses them,
# and without joint compilation the point is that every source includes what it needs.
set(_precompile OFF)
if(CMAKE_UNITY_BUILD AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(_precompile ON)
endif()
option(PADE_PRECOMPILE "Precompile the headers that most sources include" ${_precompile})

# pade_precompile(<target> FOR <target>... HEADERS <header>...): the first target's headers, which the others share; all are
# compiled with the same flags.
function(pade_precompile owner)
  cmake_parse_arguments(arg "" "" "FOR;HEADERS" ${ARGN})
  if(PADE_PRECOMPILE)
    target_precompile_headers(${owner} PRIVATE ${arg_HEADERS})
    foreach(target IN LISTS arg_FOR)
      target_precompile_headers(${target} REUSE_FROM ${owner})
    endforeach()
  endif()
endfunction()

# A twelfth of g++'s time is the collection of garbage, which it begins at 128 MB; where there is memory it need not. Not in the
# compile database of clang-tidy, which does not know the option.
cmake_host_system_information(RESULT _memory QUERY TOTAL_PHYSICAL_MEMORY)
if(CMAKE_UNITY_BUILD AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND _memory GREATER 7000)
  add_compile_options("SHELL:--param ggc-min-heapsize=2000000")
endif()

# pade_compile_jointly(<target> <group> <file>...): in preset release these files are one source to the compiler, which
# then reads their headers and makes their templates once. No two of them have the same name in an unnamed namespace.
# Files of no group are compiled alone.
function(pade_compile_jointly target group)
  set_target_properties(${target} PROPERTIES UNITY_BUILD_MODE GROUP)
  set_source_files_properties(${ARGN} PROPERTIES UNITY_GROUP ${group})
endfunction()

# pade_add_kernels(<target> <file.cpp>...): compile each file once per instruction set, with PADE_ISA
# defined to baseline, avx2 or avx512. The file puts its functions into namespace PADE_ISA; the caller picks
# one at run time with pade::simd::dispatch (core/simd.hpp). Kernel files include no heavy headers, so that no
# inline function compiled for a newer machine can be linked into the common path.
function(pade_add_kernels target)
  set(isas baseline)
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
    list(APPEND isas avx2 avx512)
  endif()
  set(flags_baseline "")
  set(flags_avx2 -mavx2 -mfma -mf16c -mbmi2)
  set(flags_avx512 -mavx512f -mavx512bw -mavx512dq -mavx512vl -mfma -mf16c -mbmi2 -mprefer-vector-width=512)
  foreach(file IN LISTS ARGN)
    get_filename_component(stem ${file} NAME_WE)
    foreach(isa IN LISTS isas)
      add_library(${stem}_${isa} OBJECT ${file})
      target_compile_definitions(${stem}_${isa} PRIVATE PADE_ISA=${isa})
      # Trapping and errno are never used; without them comparisons and square roots vectorise. NaN stays NaN.
      target_compile_options(${stem}_${isa} PRIVATE ${flags_${isa}} -O3 -fno-math-errno -fno-trapping-math
                                                    -fvisibility=hidden)
      target_include_directories(${stem}_${isa} PRIVATE ${PROJECT_SOURCE_DIR}/src)
      target_link_libraries(${stem}_${isa} PRIVATE pade_warnings)
      set_target_properties(${stem}_${isa} PROPERTIES UNITY_BUILD OFF)
      target_sources(${target} PRIVATE $<TARGET_OBJECTS:${stem}_${isa}>)
    endforeach()
  endforeach()
endfunction()

# Four times as fast as the linker that g++ takes by itself, and in the same package (binutils).
find_program(PADE_GOLD ld.gold DOC "The gold linker")
mark_as_advanced(PADE_GOLD)
if(PROJECT_IS_TOP_LEVEL AND PADE_GOLD AND NOT CMAKE_CROSSCOMPILING AND NOT PADE_SANITIZE
   AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  add_link_options(-fuse-ld=gold)
endif()
