# Cross-compiles for 64-bit ARM with Debian's g++-aarch64-linux-gnu; tests run under qemu-user.
#
#   cmake -B build-arm --toolchain cmake/aarch64-linux-gnu.cmake -DSDMT_SYSROOT=DIR \
#     -DSDMT_BUILD_TOOLS=OFF -DSDMT_BUILD_TRAIN=OFF
#
# SDMT_SYSROOT: where the packages of arm64 are unpacked (libhwy-dev, ...): docs/packages.md.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES SDMT_SYSROOT)
set(CMAKE_FIND_ROOT_PATH ${SDMT_SYSROOT} /usr)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(libraries ${SDMT_SYSROOT}/usr/lib/aarch64-linux-gnu)
set(CMAKE_PREFIX_PATH ${SDMT_SYSROOT}/usr ${libraries})
set(CMAKE_CROSSCOMPILING_EMULATOR
  qemu-aarch64 -L /usr/aarch64-linux-gnu -E LD_LIBRARY_PATH=${libraries})
