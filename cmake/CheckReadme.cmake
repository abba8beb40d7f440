# Fails unless the page README holds the text of EXAMPLE, from its first #include on.
file(READ ${README} readme)
file(READ ${EXAMPLE} example)
string(FIND "${example}" "#include" start)
string(SUBSTRING "${example}" ${start} -1 example)
string(FIND "${readme}" "${example}" found)
if(found EQUAL -1)
  message(FATAL_ERROR "${README} does not hold ${EXAMPLE} as it is: copy it there")
endif()
