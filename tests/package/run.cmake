# run(<expected> <command>...): the command, run in WORK_DIR, must succeed and say what matches
# <expected>.
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
