# Installs this build into an empty folder, builds the consumer project against it, and runs it.
# Variables: BUILD_DIR, SOURCE_DIR (of the project), WORK_DIR, GENERATOR, CXX_COMPILER.
cmake_minimum_required(VERSION 3.25)

function(run expected)
  execute_process(COMMAND ${ARGN} OUTPUT_VARIABLE output ERROR_VARIABLE output RESULT_VARIABLE code)
  if(NOT code EQUAL 0)
    message(FATAL_ERROR "failed with ${code}: ${ARGN}\n${output}")
  endif()
  if(NOT output MATCHES "${expected}")
    message(FATAL_ERROR "expected '${expected}' from: ${ARGN}\n${output}")
  endif()
endfunction()

file(REMOVE_RECURSE ${WORK_DIR})
set(prefix ${WORK_DIR}/prefix)
run("" ${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${prefix})
run("" ${CMAKE_COMMAND} -S ${SOURCE_DIR}/tests/package/consumer -B ${WORK_DIR}/build -G ${GENERATOR}
  -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER=${CXX_COMPILER} -DCMAKE_PREFIX_PATH=${prefix}
  -DEXAMPLES_DIR=${SOURCE_DIR}/docs/examples)
run("" ${CMAKE_COMMAND} --build ${WORK_DIR}/build)
run("frame 200: person 1 at 211,81" ${WORK_DIR}/build/own_detector)
run("auc 1.0 frames 1 boxes 0" ${WORK_DIR}/build/all_components)

# The installed binary finds the installed presets, with nothing of the source tree near.
run("sdmt [0-9.]+" ${prefix}/bin/sdmt --version)
run("3 frames of 160 x 120" ${prefix}/bin/sdmt synth scene --output ${WORK_DIR}/scene --frames 3
  --width 160 --height 120)
run("3 frames" ${prefix}/bin/sdmt track ${WORK_DIR}/scene --no-appearance --config track-paper
  --output ${WORK_DIR}/tracks.txt)
message(STATUS "the package works")
