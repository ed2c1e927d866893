# Compiles a C program with what pkg-config says of the installation, and runs it.
# Variables: PREFIX, LIBDIR, SOURCE, EXPECTED, ARGUMENTS, WORK_DIR.
cmake_minimum_required(VERSION 3.25)

include(${CMAKE_CURRENT_LIST_DIR}/run.cmake)

file(MAKE_DIRECTORY ${WORK_DIR})
set(ENV{PKG_CONFIG_PATH} ${PREFIX}/${LIBDIR}/pkgconfig)
set(ENV{LD_LIBRARY_PATH} ${PREFIX}/${LIBDIR})
run("" sh -ec "cc -std=c99 ${SOURCE} $(pkg-config --cflags --libs sdmt) -o program")
run("${EXPECTED}" ${WORK_DIR}/program ${ARGUMENTS})
