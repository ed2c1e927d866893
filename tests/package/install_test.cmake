# Installs this build into an empty folder. The installed binary finds the installed presets, with
# nothing of the source tree near.
# Variables: BUILD_DIR, PREFIX.
cmake_minimum_required(VERSION 3.25)

include(${CMAKE_CURRENT_LIST_DIR}/run.cmake)

set(WORK_DIR ${PREFIX})
file(REMOVE_RECURSE ${WORK_DIR})
file(MAKE_DIRECTORY ${WORK_DIR})
run("" ${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${PREFIX})
set(sdmt ${PREFIX}/bin/sdmt)
run("sdmt [0-9.]+" ${sdmt} --version)
run("3 frames of 160 x 120" ${sdmt} synth scene --output ${PREFIX}/scene --frames 3 --width 160
  --height 120)
run("3 frames" ${sdmt} track ${PREFIX}/scene --no-appearance --config track-paper
  --output ${PREFIX}/tracks-paper.txt)
