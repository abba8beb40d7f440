# Fails unless AFTER is BEFORE with at least one and at most LINES lines added, and nothing else.
execute_process(COMMAND diff ${BEFORE} ${AFTER} RESULT_VARIABLE result OUTPUT_VARIABLE difference)
if(NOT result EQUAL 1)
  message(FATAL_ERROR "diff ${BEFORE} ${AFTER} ended with ${result}, expected 1: they differ")
endif()
string(REPLACE ";" "," difference "${difference}")  # which would part what is matched
string(REGEX MATCHALL "\n< " removed "\n${difference}")
string(REGEX MATCHALL "\n> " added "\n${difference}")
list(LENGTH removed removed)
list(LENGTH added added)
if(removed GREATER 0 OR added GREATER LINES)
  message(FATAL_ERROR "${added} lines added and ${removed} removed, expected at most ${LINES} and 0:\n${difference}")
endif()
message("${added} lines added")
