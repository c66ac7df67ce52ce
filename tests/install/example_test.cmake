# Does what a user of the installed library does: configures, builds and runs the examples.
cmake_minimum_required(VERSION 3.22)
include(${CMAKE_CURRENT_LIST_DIR}/prefix.cmake)
run(${CMAKE_COMMAND} -S ${SOURCE}/examples -B ${WORK}/examples ${user_options})
run(${CMAKE_COMMAND} --build ${WORK}/examples)
run(${CMAKE_CTEST_COMMAND} --test-dir ${WORK}/examples --output-on-failure)
message("${output}")

# Navigation needs Eigen and fmt, and nothing else.
set(none "")
foreach(package PadeOpenCV OpenCV octomap GeographicLib yaml-cpp nlohmann_json Threads)
  list(APPEND none -D CMAKE_DISABLE_FIND_PACKAGE_${package}=ON)
endforeach()
run(${CMAKE_COMMAND} -S ${SOURCE}/examples/3_navigation -B ${WORK}/navigation ${user_options} ${none})
