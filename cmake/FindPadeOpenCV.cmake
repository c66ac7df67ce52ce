# OpenCV's core, imgproc, imgcodecs and video, as the imported target pade::opencv.
#
# Debian ships OpenCVConfig.cmake only in libopencv-dev (673 MB with Qt, GDAL and Java). The four module
# packages that we need have headers and libraries but no configuration, so find those by hand where there
# is no config file. Installed beside padeConfig.cmake, since a user of the library has the same need.
if(TARGET pade::opencv)
  set(PadeOpenCV_FOUND TRUE)
  return()
endif()

set(_pade_opencv_modules core imgproc imgcodecs video)
add_library(pade::opencv INTERFACE IMPORTED)

find_package(OpenCV 4.6 QUIET CONFIG COMPONENTS ${_pade_opencv_modules})
if(OpenCV_FOUND)
  set(PadeOpenCV_VERSION ${OpenCV_VERSION})
  set(PadeOpenCV_INCLUDE_DIR ${OpenCV_INCLUDE_DIRS})
  set(PadeOpenCV_LIBRARIES ${OpenCV_LIBS})
else()
  find_path(PadeOpenCV_INCLUDE_DIR opencv2/core/version.hpp PATH_SUFFIXES opencv4)
  if(PadeOpenCV_INCLUDE_DIR)
    file(STRINGS ${PadeOpenCV_INCLUDE_DIR}/opencv2/core/version.hpp _lines REGEX "#define CV_VERSION_(MAJOR|MINOR|REVISION)")
    string(REGEX REPLACE ".*MAJOR +([0-9]+).*MINOR +([0-9]+).*REVISION +([0-9]+).*" "\\1.\\2.\\3" PadeOpenCV_VERSION "${_lines}")
  endif()
  set(PadeOpenCV_LIBRARIES "")
  foreach(_module IN LISTS _pade_opencv_modules)
    find_library(PadeOpenCV_${_module}_LIBRARY opencv_${_module})
    if(NOT PadeOpenCV_${_module}_LIBRARY OR NOT EXISTS ${PadeOpenCV_INCLUDE_DIR}/opencv2/${_module}.hpp)
      message(STATUS "OpenCV module ${_module} is missing (Debian: libopencv-${_module}-dev)")
      set(PadeOpenCV_LIBRARIES "PadeOpenCV_LIBRARIES-NOTFOUND")
      break()
    endif()
    list(APPEND PadeOpenCV_LIBRARIES ${PadeOpenCV_${_module}_LIBRARY})
  endforeach()
endif()

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(PadeOpenCV REQUIRED_VARS PadeOpenCV_LIBRARIES PadeOpenCV_INCLUDE_DIR
                                  VERSION_VAR PadeOpenCV_VERSION)
if(PadeOpenCV_FOUND)
  target_include_directories(pade::opencv SYSTEM INTERFACE ${PadeOpenCV_INCLUDE_DIR})
  target_link_libraries(pade::opencv INTERFACE ${PadeOpenCV_LIBRARIES})
endif()
