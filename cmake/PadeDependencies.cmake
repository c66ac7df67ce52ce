# The libraries that pade needs. Read by the build and, installed, by padeConfig.cmake, so that the two cannot
# drift apart. Third-party headers are SYSTEM: their warnings are not ours.

macro(pade_find)
  if(CMAKE_FIND_PACKAGE_NAME STREQUAL "pade")
    find_dependency(${ARGN})
  else()
    find_package(${ARGN} REQUIRED)
  endif()
endmacro()

list(APPEND CMAKE_MODULE_PATH /usr/share/cmake/geographiclib)  # where Debian puts FindGeographicLib.cmake
pade_find(Eigen3 3.4 NO_MODULE)
pade_find(PadeOpenCV)
pade_find(octomap 1.9)
pade_find(GeographicLib 2.1)
pade_find(yaml-cpp 0.7)
pade_find(nlohmann_json 3.11)
pade_find(fmt 9)
pade_find(spdlog 1.10)
pade_find(Threads)

# These two come with variables, or with targets without their include folder.
if(NOT TARGET pade::octomap)
  add_library(pade::octomap INTERFACE IMPORTED)
  target_include_directories(pade::octomap SYSTEM INTERFACE ${OCTOMAP_INCLUDE_DIRS})
  target_link_libraries(pade::octomap INTERFACE octomap octomath)
endif()
if(NOT TARGET pade::geographiclib)
  add_library(pade::geographiclib INTERFACE IMPORTED)
  target_include_directories(pade::geographiclib SYSTEM INTERFACE ${GeographicLib_INCLUDE_DIRS})
  target_link_libraries(pade::geographiclib INTERFACE ${GeographicLib_LIBRARIES})
endif()
