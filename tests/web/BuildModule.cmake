# Builds TARGET of the WebAssembly preset of SOURCE in BUILD, one file at a time: other tests run beside it. Bullet's source is
# in BULLET, or fetched.
execute_process(COMMAND ${CMAKE_COMMAND} --preset web -B ${BUILD} -D CAROM_BULLET_SOURCE=${BULLET}
  WORKING_DIRECTORY ${SOURCE} COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${CMAKE_COMMAND} --build ${BUILD} --target ${TARGET} -j 1 COMMAND_ERROR_IS_FATAL ANY)
