# Installs this build into an empty folder. The installed binary finds the installed presets, with
# nothing of the source tree near.
# Variables: BUILD_DIR, PREFIX.
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

file(REMOVE_RECURSE ${PREFIX})
run("" ${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${PREFIX})
set(sdmt ${PREFIX}/bin/sdmt)
run("sdmt [0-9.]+" ${sdmt} --version)
run("3 frames of 160 x 120" ${sdmt} synth scene --output ${PREFIX}/scene --frames 3 --width 160
  --height 120)
run("3 frames" ${sdmt} track ${PREFIX}/scene --no-appearance --config track-paper
  --output ${PREFIX}/tracks-paper.txt)
