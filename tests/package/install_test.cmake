# Installs this build into an empty folder. The installed binary finds the installed presets, with
# nothing of the source tree near.
# Variables: BUILD_DIR, PREFIX, PROJECT_DIR.
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
foreach(file share/man/man1/sdmt-track.1.gz share/bash-completion/completions/sdmt
    share/doc/sdmt/copyright share/doc/sdmt/sdmt.spdx share/doc/sdmt-models/README.md
    share/sdmt/models/sdmt-lite.safetensors share/sdmt/configs/track-paper.json)
  if(NOT EXISTS ${PREFIX}/${file})
    message(FATAL_ERROR "${file} is not installed")
  endif()
endforeach()

# Into another folder, and out again: what was there before is all that is left.
set(ENV{DESTDIR} ${PREFIX}/staged)
file(WRITE ${PREFIX}/staged/usr/share/keep/this "")
run("" ${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix /usr)
run("removed" ${CMAKE_COMMAND} -DMANIFEST=${BUILD_DIR}/install_manifest.txt
  -P ${PROJECT_DIR}/cmake/uninstall.cmake)
file(GLOB_RECURSE left RELATIVE ${PREFIX}/staged ${PREFIX}/staged/*)
if(NOT left STREQUAL "usr/share/keep/this")
  message(FATAL_ERROR "left by the removal: ${left}")
endif()
