# OpenCV's core, imgproc and video, as the imported target pade::opencv; with COMPONENTS imgcodecs also
# pade::opencv_imgcodecs.
#
# Debian ships OpenCVConfig.cmake only in libopencv-dev (673 MB with Qt, GDAL and Java). The module packages that we
# need have headers and libraries but no configuration, so find those by hand where there is no config file. Installed
# beside padeConfig.cmake, since a user of the library has the same need.
set(_pade_opencv_modules core imgproc video ${PadeOpenCV_FIND_COMPONENTS})
find_package(OpenCV 4.6 QUIET CONFIG COMPONENTS ${_pade_opencv_modules})
set(_pade_opencv_libraries "")
if(OpenCV_FOUND)
  set(PadeOpenCV_VERSION ${OpenCV_VERSION})
  set(PadeOpenCV_INCLUDE_DIR ${OpenCV_INCLUDE_DIRS})
  foreach(_module IN LISTS _pade_opencv_modules)
    set(PadeOpenCV_${_module}_LIBRARY opencv_${_module})
  endforeach()
else()
  find_path(PadeOpenCV_INCLUDE_DIR opencv2/core/version.hpp PATH_SUFFIXES opencv4)
  if(PadeOpenCV_INCLUDE_DIR)
    file(STRINGS ${PadeOpenCV_INCLUDE_DIR}/opencv2/core/version.hpp _lines REGEX "#define CV_VERSION_(MAJOR|MINOR|REVISION)")
    string(REGEX REPLACE ".*MAJOR +([0-9]+).*MINOR +([0-9]+).*REVISION +([0-9]+).*" "\\1.\\2.\\3" PadeOpenCV_VERSION "${_lines}")
  endif()
  foreach(_module IN LISTS _pade_opencv_modules)
    find_library(PadeOpenCV_${_module}_LIBRARY opencv_${_module})
    if(NOT PadeOpenCV_${_module}_LIBRARY OR NOT EXISTS ${PadeOpenCV_INCLUDE_DIR}/opencv2/${_module}.hpp)
      message(STATUS "OpenCV module ${_module} is missing (Debian: libopencv-${_module}-dev)")
    endif()
  endforeach()
endif()

list(TRANSFORM _pade_opencv_modules REPLACE "(.+)" "PadeOpenCV_\\1_LIBRARY" OUTPUT_VARIABLE _pade_opencv_libraries)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(PadeOpenCV REQUIRED_VARS ${_pade_opencv_libraries} PadeOpenCV_INCLUDE_DIR
                                  VERSION_VAR PadeOpenCV_VERSION)
if(PadeOpenCV_FOUND)
  if(NOT TARGET pade::opencv)
    add_library(pade::opencv INTERFACE IMPORTED)
    target_include_directories(pade::opencv SYSTEM INTERFACE ${PadeOpenCV_INCLUDE_DIR})
    target_link_libraries(pade::opencv INTERFACE ${PadeOpenCV_core_LIBRARY} ${PadeOpenCV_imgproc_LIBRARY}
                                                 ${PadeOpenCV_video_LIBRARY})
  endif()
  foreach(_module IN LISTS PadeOpenCV_FIND_COMPONENTS)
    if(NOT TARGET pade::opencv_${_module})
      add_library(pade::opencv_${_module} INTERFACE IMPORTED)
      target_link_libraries(pade::opencv_${_module} INTERFACE pade::opencv ${PadeOpenCV_${_module}_LIBRARY})
    endif()
  endforeach()
endif()
