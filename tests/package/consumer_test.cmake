# Builds a project that uses one component of the installation, and runs its program.
# Variables: COMPONENT, ALSO, SOURCE, EXPECTED, ARGUMENTS, PREFIX, PROJECT_DIR, WORK_DIR, GENERATOR,
# CXX_COMPILER.
cmake_minimum_required(VERSION 3.25)

function(run expected)
  execute_process(COMMAND ${ARGN} WORKING_DIRECTORY ${WORK_DIR} OUTPUT_VARIABLE output
    ERROR_VARIABLE output RESULT_VARIABLE code)
  if(NOT code EQUAL 0)
    message(FATAL_ERROR "failed with ${code}: ${ARGN}\n${output}")
  endif()
  if(NOT output MATCHES "${expected}")
    message(FATAL_ERROR "expected '${expected}' from: ${ARGN}\n${output}")
  endif()
endfunction()

file(REMOVE_RECURSE ${WORK_DIR})
file(MAKE_DIRECTORY ${WORK_DIR})
run("" ${CMAKE_COMMAND} -S ${PROJECT_DIR} -B ${WORK_DIR}/build -G ${GENERATOR}
  -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER=${CXX_COMPILER} -DCMAKE_PREFIX_PATH=${PREFIX}
  -DCOMPONENT=${COMPONENT} -DALSO=${ALSO} -DSOURCE=${SOURCE})
run("" ${CMAKE_COMMAND} --build ${WORK_DIR}/build)
run("${EXPECTED}" ${WORK_DIR}/build/consumer ${ARGUMENTS})
