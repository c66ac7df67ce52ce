# What `cmake --install` and `cpack` put where: the program (component "pade"), the library with its headers (component
# "libpade-dev") and, where they are built, the modules for more image formats (component "pade-image-formats") and for videos ("pade-video"), and the Python
# module (component "python3-pade", whose files python/ installs).
include(CMakePackageConfigHelpers)

set(pade_cmake_folder ${CMAKE_INSTALL_LIBDIR}/cmake/pade)

# The rooms that users take alone, and their public headers: these, and what they include. Everything else may change
# from one version to the next and is not installed.
set(pade_public_headers
  pade.hpp
  core/camera.hpp
  core/depth_image.hpp
  core/flow_field.hpp
  core/frame.hpp
  core/health.hpp
  core/lie.hpp
  core/options.hpp
  core/point_cloud.hpp
  core/pose.hpp
  core/result.hpp
  core/sensors/measurements.hpp
  core/sensors/navigation_log.hpp
  core/sensors/pose_jumps.hpp
  core/time.hpp
  navigation/camera/camera_motion.hpp
  navigation/filter_options.hpp
  navigation/measurement.hpp
  navigation/navigator.hpp
  flow/flow_estimator.hpp
  flow/epipolar/multi_view.hpp
  depth/depth_estimator.hpp
  depth/depth_options.hpp
  depth/derotation.hpp
  depth/edges.hpp
  depth/focus_of_expansion.hpp
  depth/image/footing.hpp
  depth/motion/baseline_window.hpp
  depth/motion/motion_alignment.hpp
  depth/motion/motion_refinement.hpp
  depth/motion/stamp_clock.hpp
  depth/multi_view/common_error.hpp
  depth/multi_view/views_depth.hpp
  mapping/back_projection.hpp
  mapping/occupancy_map.hpp
  mapping/query/map_border.hpp
  mapping/query/map_view.hpp
  io/atomic_output.hpp
  io/formats/map_files.hpp
  io/navigation/geodetic_fixes.hpp
  io/options_json.hpp
  io/recording/messages/image_messages.hpp
  io/world.hpp
  pipeline/obstacle_mapper.hpp
  pipeline/recent_frames.hpp)
install(TARGETS pade_pose pade_core pade_navigation pade_flow pade_depth pade_mapping pade_io pade
        EXPORT padeTargets COMPONENT libpade-dev)
install(EXPORT padeTargets NAMESPACE pade:: DESTINATION ${pade_cmake_folder} COMPONENT libpade-dev)
foreach(header IN LISTS pade_public_headers)
  get_filename_component(folder ${header} DIRECTORY)
  install(FILES ${PROJECT_SOURCE_DIR}/src/pade/${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/pade/${folder}
          COMPONENT libpade-dev)
endforeach()
install(FILES ${PROJECT_BINARY_DIR}/generated/pade/core/version.hpp
        DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/pade/core COMPONENT libpade-dev)

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/padeConfig.cmake.in ${PROJECT_BINARY_DIR}/padeConfig.cmake
                              INSTALL_DESTINATION ${pade_cmake_folder})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/padeConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/padeConfig.cmake ${PROJECT_BINARY_DIR}/padeConfigVersion.cmake
              ${PROJECT_SOURCE_DIR}/cmake/PadeDependencies.cmake ${PROJECT_SOURCE_DIR}/cmake/FindPadeOpenCV.cmake
        DESTINATION ${pade_cmake_folder} COMPONENT libpade-dev)

# The program finds its modules by their names, in the folder of libraries beside its own.
file(RELATIVE_PATH _libraries ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR})
set_target_properties(pade_cli PROPERTIES INSTALL_RPATH "$ORIGIN/${_libraries}")
install(TARGETS pade_cli RUNTIME COMPONENT pade)
if(TARGET pade_image_formats)
  install(TARGETS pade_image_formats LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT pade-image-formats)
endif()
if(TARGET pade_video)
  install(TARGETS pade_video LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT pade-video)
endif()
# Where systemd looks beside the packages' own.
configure_file(${PROJECT_SOURCE_DIR}/config/systemd/pade-live@.service.in ${PROJECT_BINARY_DIR}/pade-live@.service @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/pade-live@.service DESTINATION lib/systemd/system COMPONENT pade)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/config/live DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/pade/examples COMPONENT pade)
set(_packages pade libpade-dev)
if(TARGET pade_image_formats)
  list(APPEND _packages pade-image-formats)
endif()
if(TARGET pade_video)
  list(APPEND _packages pade-video)
endif()
foreach(component IN LISTS _packages)
  install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${component} RENAME copyright
          COMPONENT ${component})
endforeach()

# The Debian packages, one per component: cpack -G DEB
set(CPACK_PACKAGE_NAME pade)
set(CPACK_PACKAGE_CONTACT "The PADE authors <${PROJECT_HOMEPAGE_URL}/issues>")
set(CPACK_DEBIAN_PACKAGE_HOMEPAGE ${PROJECT_HOMEPAGE_URL})
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY ${PROJECT_DESCRIPTION})
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL ${_packages})
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_DEPENDS "")
set(CPACK_DEBIAN_PADE_PACKAGE_NAME pade)
set(CPACK_DEBIAN_PADE_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PADE_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PADE_PACKAGE_SUGGESTS "pade-image-formats, pade-video")  # bring OpenCV's imgcodecs with GDAL, and FFmpeg's libraries
set(CPACK_DEBIAN_PADE-IMAGE-FORMATS_PACKAGE_NAME pade-image-formats)
set(CPACK_DEBIAN_PADE-IMAGE-FORMATS_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PADE-IMAGE-FORMATS_PACKAGE_SHLIBDEPS ON)
set(CPACK_COMPONENT_PADE-IMAGE-FORMATS_DESCRIPTION "Obstacle maps from one camera and a GPS/INS: image formats other than PNG, JPEG, PGM and PPM.")
set(CPACK_DEBIAN_PADE-VIDEO_PACKAGE_NAME pade-video)
set(CPACK_DEBIAN_PADE-VIDEO_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PADE-VIDEO_PACKAGE_SHLIBDEPS ON)
set(CPACK_COMPONENT_PADE-VIDEO_DESCRIPTION "Obstacle maps from one camera and a GPS/INS: video files and network streams.")
set(CPACK_DEBIAN_LIBPADE-DEV_PACKAGE_NAME libpade-dev)
set(CPACK_DEBIAN_LIBPADE-DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_LIBPADE-DEV_PACKAGE_DEPENDS
    "libeigen3-dev (>= 3.4), libopencv-core-dev (>= 4.6), libopencv-imgproc-dev, \
libopencv-video-dev, libpng-dev, libjpeg-dev, liboctomap-dev (>= 1.9), libgeographiclib-dev (>= 2.1), libyaml-cpp-dev (>= 0.7), \
nlohmann-json3-dev (>= 3.11), libfmt-dev (>= 9)")
foreach(pair IN ITEMS bzip2/libbz2-dev lz4/liblz4-dev sqlite/libsqlite3-dev zstd/libzstd-dev)
  string(REPLACE "/" ";" pair ${pair})
  list(GET pair 0 part)
  list(GET pair 1 package)
  if(TARGET pade::${part})
    string(APPEND CPACK_DEBIAN_LIBPADE-DEV_PACKAGE_DEPENDS ", ${package}")
  endif()
endforeach()
if(PADE_BUILD_PYTHON)
  list(APPEND CPACK_COMPONENTS_ALL python3-pade)
  set(CPACK_DEBIAN_PYTHON3-PADE_PACKAGE_NAME python3-pade)
  set(CPACK_DEBIAN_PYTHON3-PADE_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON3-PADE_PACKAGE_SHLIBDEPS ON)
  math(EXPR _next_python "${PADE_PYTHON_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON3-PADE_PACKAGE_DEPENDS
      "python3 (>= 3.${PADE_PYTHON_MINOR}), python3 (<< 3.${_next_python}), python3-numpy")
  set(CPACK_COMPONENT_PYTHON3-PADE_DESCRIPTION "Obstacle maps from one camera and a GPS/INS: the Python module.")
endif()
set(CPACK_COMPONENT_PADE_DESCRIPTION "Obstacle maps from one camera and a GPS/INS: the program.")
set(CPACK_COMPONENT_LIBPADE-DEV_DESCRIPTION "Obstacle maps from one camera and a GPS/INS: library, headers and CMake files.")
include(CPack)
