# A program's standard output must be, byte for byte, what `sdmt track` writes for the same boxes.
# Variables: SDMT, SCENE, WORK_DIR, PROGRAM (a list; the file of boxes is put behind it).
cmake_minimum_required(VERSION 3.25)

set(boxes ${SCENE}/det/det.txt)
set(expected ${WORK_DIR}/command.txt)
file(MAKE_DIRECTORY ${WORK_DIR})
execute_process(COMMAND ${SDMT} track ${SCENE} --no-appearance --output ${expected}
  COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${PROGRAM} ${boxes} OUTPUT_FILE ${WORK_DIR}/program.txt
  COMMAND_ERROR_IS_FATAL ANY)
file(SIZE ${expected} size)
if(size LESS 1000)
  message(FATAL_ERROR "${expected}: ${size} bytes say little")
endif()
execute_process(COMMAND ${CMAKE_COMMAND} -E compare_files ${expected} ${WORK_DIR}/program.txt
  COMMAND_ERROR_IS_FATAL ANY)
