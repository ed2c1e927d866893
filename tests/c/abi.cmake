# The binary interface of libsdmt must be the one that abi.txt tells: symbols with their versions,
# structs and constants on a 64-bit machine. What may change, and when, is in CONTRIBUTING.md.
# Variables: NM, LIBRARY, LAYOUT, EXPECTED, FOUND.
cmake_minimum_required(VERSION 3.25)

execute_process(COMMAND ${NM} -D --defined-only ${LIBRARY} OUTPUT_VARIABLE symbols
  COMMAND_ERROR_IS_FATAL ANY)
string(REGEX REPLACE "(^|\n)[0-9a-f]+ " "\\1" symbols "${symbols}")
execute_process(COMMAND ${LAYOUT} OUTPUT_VARIABLE layout COMMAND_ERROR_IS_FATAL ANY)
file(WRITE ${FOUND} "${symbols}${layout}")
file(READ ${EXPECTED} expected)
if(NOT expected STREQUAL "${symbols}${layout}")
  execute_process(COMMAND diff -u ${EXPECTED} ${FOUND})
  message(FATAL_ERROR "the binary interface has changed: ${FOUND} is not ${EXPECTED}")
endif()
