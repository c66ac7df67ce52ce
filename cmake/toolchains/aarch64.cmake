# For 64-bit ARM (aarch64, Debian's arm64) on another machine, with Debian's cross compiler. scripts/cross-aarch64 makes the
# folder with the libraries of Debian's arm64, and calls CMake with this file:
#   cmake -B build-aarch64 --toolchain cmake/toolchains/aarch64.cmake -D CMAKE_SYSROOT=<folder>
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES CMAKE_SYSROOT)

# Programs are of this machine, and nothing else is.
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
list(APPEND CMAKE_MODULE_PATH ${CMAKE_SYSROOT}/usr/share/cmake/geographiclib)
set(ENV{PKG_CONFIG_SYSROOT_DIR} ${CMAKE_SYSROOT})
set(ENV{PKG_CONFIG_LIBDIR} ${CMAKE_SYSROOT}/usr/lib/aarch64-linux-gnu/pkgconfig:${CMAKE_SYSROOT}/usr/share/pkgconfig)

# What is built can be run here, slowly: tests are listed and run so.
find_program(PADE_AARCH64_EMULATOR qemu-aarch64)
mark_as_advanced(PADE_AARCH64_EMULATOR)
if(PADE_AARCH64_EMULATOR)
  set(CMAKE_CROSSCOMPILING_EMULATOR ${PADE_AARCH64_EMULATOR} -L ${CMAKE_SYSROOT})
endif()

# What the packages need of others is read from the folder: its DEBIAN/symbols and DEBIAN/shlibs are all packages' together.
set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE arm64)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${CMAKE_SYSROOT}/usr/lib/aarch64-linux-gnu)
