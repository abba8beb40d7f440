# Configures the host with the build type TYPE ("" for none) and the flags FLAGS, and fails unless
# Carom's own sources are compiled with WANTED (-O2 or nothing) and the host's own without.
file(REMOVE_RECURSE ${FOLDER})
execute_process(COMMAND ${CMAKE_COMMAND} -S ${HOST} -B ${FOLDER} -G Ninja -DWAY=add_subdirectory
  -DCAROM_SOURCE=${SOURCE} -DCMAKE_EXPORT_COMPILE_COMMANDS=ON -DCMAKE_BUILD_TYPE=${TYPE}
  -DCMAKE_CXX_COMPILER=${COMPILER} "-DCMAKE_CXX_FLAGS=${FLAGS}"
  OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
file(READ ${FOLDER}/compile_commands.json commands)
string(JSON count LENGTH "${commands}")
math(EXPR last "${count} - 1")
set(ours 0)
foreach(index RANGE ${last})
  string(JSON file GET "${commands}" ${index} file)
  string(JSON command GET "${commands}" ${index} command)
  if(file MATCHES "host/main.cpp$")
    if(command MATCHES " -O2 ")
      message(FATAL_ERROR "the host's own source is compiled with -O2, which it did not ask for")
    endif()
  elseif(file MATCHES "/(audio|bullet_bridge|plugin)/([a-z_]+/)?[a-z_0-9]+[.]cpp$")
    math(EXPR ours "${ours} + 1")
    if((WANTED STREQUAL "-O2" AND NOT command MATCHES " -O2 ") OR
       (NOT WANTED STREQUAL "-O2" AND command MATCHES " -O2 "))
      message(FATAL_ERROR "${file}, with the build type '${TYPE}' and the flags '${FLAGS}': ${command}")
    endif()
  endif()
endforeach()
if(ours LESS 50)
  message(FATAL_ERROR "only ${ours} sources of the layers were found")
endif()
message(STATUS "${ours} sources are compiled as they should be")
