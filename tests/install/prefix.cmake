# Shared by the tests of the installed library: a fresh prefix below WORK with the library in it, and run().
#   cmake -D BUILD=<build folder> -D SOURCE=<source folder> -D WORK=<scratch folder> -D COMPILER=<c++>
#         -D GENERATOR=<CMake generator> -D FLAGS=<compiler flags> -P <test>.cmake

# run(COMMAND...): the command's output in ${output}; the test fails when the command does.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "${command}\nended with ${status}:\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${WORK})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix)
set(user_options -G "${GENERATOR}" -D CMAKE_PREFIX_PATH=${WORK}/prefix -D CMAKE_BUILD_TYPE=Release "-DCMAKE_CXX_FLAGS=${FLAGS}"
                 -D CMAKE_CXX_COMPILER=${COMPILER})
