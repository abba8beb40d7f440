# Packs what BUILD has built with debian/, in FOLDER, and looks into the packages.
file(REMOVE_RECURSE ${FOLDER})
set(usr ${FOLDER}/usr)
execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD} --prefix ${usr} --config ${CONFIG}
  OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
# As dpkg-buildpackage configures it.
if(NOT LIBDIR MATCHES "/")
  execute_process(COMMAND dpkg-architecture -qDEB_HOST_MULTIARCH OUTPUT_VARIABLE architecture
    OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
  file(RENAME ${usr}/${LIBDIR} ${FOLDER}/libraries)
  file(MAKE_DIRECTORY ${usr}/lib)
  file(RENAME ${FOLDER}/libraries ${usr}/lib/${architecture})
  set(LIBDIR lib/${architecture})
endif()

file(COPY ${SOURCE}/debian ${SOURCE}/CHANGELOG.md DESTINATION ${FOLDER}/source)
execute_process(COMMAND make -f debian/rules binary CAROM_INSTALLED=${usr} WORKING_DIRECTORY ${FOLDER}/source
  OUTPUT_VARIABLE output ERROR_VARIABLE output RESULT_VARIABLE result)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "debian/rules ended with ${result}:\n${output}")
endif()

# Fails unless the package holds all of the files, for root, under /usr and nowhere else.
function(expect_files package)
  execute_process(COMMAND ${DPKG_DEB} -c ${package} OUTPUT_VARIABLE list COMMAND_ERROR_IS_FATAL ANY)
  foreach(file IN LISTS ARGN)
    if(NOT list MATCHES " \\./usr/${file}( -> [^\n]*)?\n")
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
  ${LIBDIR}/libcarom_bullet.a ${LIBDIR}/libcarom_plugin.a ${LIBDIR}/libcarom.so
  ${LIBDIR}/cmake/carom/carom-config.cmake ${LIBDIR}/pkgconfig/carom.pc
  share/doc/libcarom-dev/copyright share/doc/libcarom-dev/changelog.Debian.gz share/doc/libcarom-dev/changelog.gz)
# What the layers link, by the table in cmake/CaromInstall.cmake.
foreach(package IN LISTS DEPENDS)
  string(REGEX REPLACE "([().+])" "\\\\\\1" pattern "${package}")
  expect_field(${development} Depends "(^|, )${pattern}(,|\n)")
endforeach()
expect_field(${development} Version "^${VERSION}-")  # debian/changelog and CMakeLists.txt say the same

string(REGEX MATCH "^[0-9]+[.][0-9]+" abi ${VERSION})
file(GLOB library ${FOLDER}/libcarom${abi}_*.deb)
expect_files(${library} ${LIBDIR}/libcarom.so.${abi})
expect_field(${library} Depends "libc6")  # found by dpkg-shlibdeps

file(GLOB command ${FOLDER}/carom_*.deb)
expect_files(${command} bin/carom share/carom/scenes/bouncing_ball.json share/carom/scenes/meshes/wrench.obj
  share/doc/carom/copyright share/man/man1/carom-render.1.gz share/bash-completion/completions/carom share/zsh/vendor-completions/_carom
  share/fish/vendor_completions.d/carom.fish)
if(LISTEN)
  expect_files(${command} ${LIBDIR}/carom/libcarom_listen.so ${LIBDIR}/carom/libcarom_listen_float.so
    ${LIBDIR}/carom/libcarom_listen_double.so)
endif()
expect_field(${command} Depends "libsndfile1")

file(GLOB documentation ${FOLDER}/carom-doc_*_all.deb)
expect_files(${documentation} share/doc/carom/README.md share/doc/carom/docs/install.md
  share/doc/carom/examples/CMakeLists.txt share/doc/carom/examples/hello_world.cpp)

# They are not compiled as dpkg-buildpackage does, of which lintian would only inform.
if(LINTIAN)
  file(GLOB packages ${FOLDER}/*.deb)
  execute_process(COMMAND ${LINTIAN} --fail-on error,warning ${packages}
    OUTPUT_VARIABLE said ERROR_VARIABLE said RESULT_VARIABLE result)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "lintian ended with ${result}:\n${said}")
  endif()
endif()
