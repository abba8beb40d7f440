# Installs BUILD and moves the tree to PREFIX: nothing in it may know where it was installed.
file(REMOVE_RECURSE ${PREFIX} ${PREFIX}_first)
execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD} --prefix ${PREFIX}_first --config ${CONFIG}
  OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
file(RENAME ${PREFIX}_first ${PREFIX})

# The program and the pages beside it are of one version, and the scenes have the files that they name.
execute_process(COMMAND ${PREFIX}/bin/carom --version OUTPUT_VARIABLE version OUTPUT_STRIP_TRAILING_WHITESPACE
  COMMAND_ERROR_IS_FATAL ANY)
foreach(page README.md docs/README.md)
  file(READ ${PREFIX}/share/doc/carom/${page} text)
  string(FIND "${text}" "\n\nVersion ${version}.\n" at)
  if(at LESS 0)
    message(FATAL_ERROR "carom is of version '${version}', and ${page} does not say so")
  endif()
endforeach()
file(GLOB scenes ${PREFIX}/share/carom/scenes/*.json)
foreach(scene IN LISTS scenes)
  execute_process(COMMAND ${PREFIX}/bin/carom info ${scene} OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
endforeach()

# The program finds them by their names, in the tree that it has moved to.
execute_process(COMMAND ${PREFIX}/bin/carom scenes --paths two_balls OUTPUT_VARIABLE path OUTPUT_STRIP_TRAILING_WHITESPACE
  COMMAND_ERROR_IS_FATAL ANY)
file(REAL_PATH ${PREFIX}/share/carom/scenes/two_balls.json expected)
if(NOT path STREQUAL expected)
  message(FATAL_ERROR "carom finds two_balls as '${path}', and not as '${expected}'")
endif()
