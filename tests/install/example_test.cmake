# Does what a user of the installed library does: configures, builds and runs examples/minimal.
cmake_minimum_required(VERSION 3.22)
include(${CMAKE_CURRENT_LIST_DIR}/prefix.cmake)
run(${CMAKE_COMMAND} -S ${SOURCE}/examples/minimal -B ${WORK}/minimal ${user_options})
run(${CMAKE_COMMAND} --build ${WORK}/minimal)
run(${WORK}/minimal/minimal)
message("${output}")
