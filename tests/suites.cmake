# Writes what CTest runs of a test program: one test per suite. A process for each single test would spend most of its time
# on loading the hundred libraries behind OpenCV's image files.
#   cmake -D PROGRAM=<test program> -D LIST=<file to write> -D PROPERTIES=<list for set_tests_properties>
#         [-D EMULATOR=<command before the program>] -P suites.cmake
cmake_minimum_required(VERSION 3.22)
execute_process(COMMAND ${EMULATOR} ${PROGRAM} --gtest_list_tests RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE errors
                TIMEOUT 60)
if(NOT status EQUAL 0)
  message(FATAL_ERROR "${PROGRAM} --gtest_list_tests ended with ${status}:\n${output}${errors}")
endif()

# A suite stands at the start of a line and ends in a dot; its tests are indented. One is skipped that skips all its tests and
# fails none: nothing follows the list of those skipped.
string(REPLACE ";" " " properties "${PROPERTIES}")
set(skipped "PASSED  . 0 tests[.]\n(.  SKIPPED . [^\n]*\n)+$")
string(REPLACE "\n" ";" lines "${output}")
get_filename_component(program ${PROGRAM} NAME)
list(TRANSFORM EMULATOR REPLACE "(.+)" "[==[\\1]==]" OUTPUT_VARIABLE emulator)
list(JOIN emulator " " emulator)
set(content "")
foreach(line IN LISTS lines)
  if(line MATCHES "^([^ ]+)\\.( |$)")
    set(suite ${CMAKE_MATCH_1})
    string(APPEND content "add_test([==[${program}.${suite}]==] ${emulator} [==[${PROGRAM}]==] [==[--gtest_filter=${suite}.*]==])
set_tests_properties([==[${program}.${suite}]==] PROPERTIES SKIP_REGULAR_EXPRESSION [==[${skipped}]==] ${properties})
")
  endif()
endforeach()
if(NOT content)
  message(FATAL_ERROR "${PROGRAM} has no tests:\n${output}")
endif()
file(WRITE ${LIST} "${content}")
