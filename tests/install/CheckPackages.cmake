# Makes the Debian packages of BUILD in FOLDER and looks into them.
file(REMOVE_RECURSE ${FOLDER})
execute_process(COMMAND ${CPACK} -G DEB -C ${CONFIG} -B ${FOLDER} WORKING_DIRECTORY ${BUILD}
  OUTPUT_VARIABLE output ERROR_VARIABLE output RESULT_VARIABLE result)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "cpack ended with ${result}:\n${output}")
endif()

# Fails unless the package holds all of the files, for root, under /usr and nowhere else.
function(expect_files package)
  execute_process(COMMAND ${DPKG_DEB} -c ${package} OUTPUT_VARIABLE list COMMAND_ERROR_IS_FATAL ANY)
  foreach(file IN LISTS ARGN)
    if(NOT list MATCHES " \\./usr/${file}\n")
      message(FATAL_ERROR "${package} lacks /usr/${file}:\n${list}")
    endif()
  endforeach()
  string(REGEX REPLACE "[^\n]* root/root [^\n]* \\./(usr/[^\n]*)?\n" "" strange "${list}")
  if(NOT strange STREQUAL "")
    message(FATAL_ERROR "${package} holds what is not for root or not under /usr:\n${strange}")
  endif()
endfunction()

function(expect_field package field expression)
  execute_process(COMMAND ${DPKG_DEB} -f ${package} ${field} OUTPUT_VARIABLE value COMMAND_ERROR_IS_FATAL ANY)
  if(NOT value MATCHES "${expression}")
    message(FATAL_ERROR "${package}: ${field} is '${value}', expected '${expression}'")
  endif()
endfunction()

file(GLOB development ${FOLDER}/libcarom-dev_*.deb)
expect_files(${development} include/carom/sound.h include/carom/event_sound.h
  include/carom/audio/material.h include/carom/bullet/bullet_bridge.h
  include/carom/modal/mesh_analysis.h include/carom/native/sphere_stepper.h
  ${LIBDIR}/libcarom_audio.a ${LIBDIR}/libcarom_modal.a ${LIBDIR}/libcarom_native.a
  ${LIBDIR}/libcarom_bullet.a ${LIBDIR}/libcarom_plugin.a ${LIBDIR}/cmake/carom/carom-config.cmake
  ${LIBDIR}/pkgconfig/carom.pc share/doc/libcarom-dev/copyright)
expect_field(${development} Depends "libeigen3-dev.*libsndfile1-dev.*libbullet-dev.*libsdl2-dev")
if(MUMPS)
  expect_field(${development} Depends "libmumps-seq-dev")
endif()
expect_field(${development} Section libdevel)
expect_field(${development} Maintainer "^Carom developers <carom@localhost>")
expect_field(${development} Version "^${VERSION}-")

file(GLOB command ${FOLDER}/carom_*.deb)
expect_files(${command} bin/carom share/carom/scenes/bouncing_ball.json share/carom/scenes/meshes/wrench.obj
  share/doc/carom/copyright share/bash-completion/completions/carom share/zsh/site-functions/_carom
  share/fish/vendor_completions.d/carom.fish)
if(LISTEN)
  expect_files(${command} ${LIBDIR}/carom/libcarom_listen.so ${LIBDIR}/carom/libcarom_listen_float.so
    ${LIBDIR}/carom/libcarom_listen_double.so)
endif()
expect_field(${command} Depends "libsndfile1")  # found by dpkg-shlibdeps
expect_field(${command} Section sound)
