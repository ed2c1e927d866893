# Builds a project that uses one component of the installation, and runs its program.
# Variables: COMPONENT, ALSO, SOURCE, EXPECTED, ARGUMENTS, PREFIX, PROJECT_DIR, WORK_DIR, GENERATOR,
# CXX_COMPILER.
cmake_minimum_required(VERSION 3.25)

include(${CMAKE_CURRENT_LIST_DIR}/run.cmake)

file(REMOVE_RECURSE ${WORK_DIR})
file(MAKE_DIRECTORY ${WORK_DIR})
run("" ${CMAKE_COMMAND} -S ${PROJECT_DIR} -B ${WORK_DIR}/build -G ${GENERATOR}
  -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER=${CXX_COMPILER} -DCMAKE_PREFIX_PATH=${PREFIX}
  -DCOMPONENT=${COMPONENT} -DALSO=${ALSO} -DSOURCE=${SOURCE})
run("" ${CMAKE_COMMAND} --build ${WORK_DIR}/build)
run("${EXPECTED}" ${WORK_DIR}/build/consumer ${ARGUMENTS})
