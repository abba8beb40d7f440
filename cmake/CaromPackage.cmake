# `cpack -G DEB`: libcarom-dev with the static libraries and headers, carom with the command, and
# libcarom0.1 with the C interface if it is built as a shared library.
set(CPACK_PACKAGE_NAME carom)
set(CPACK_PACKAGE_VENDOR "Carom developers")
set(CPACK_PACKAGE_CONTACT "Carom developers <carom@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_VERBATIM_VARIABLES ON)
set(CPACK_STRIP_FILES ON)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_COMPONENTS_ALL Development)
if(TARGET carom)
  list(APPEND CPACK_COMPONENTS_ALL Runtime)
endif()

if(TARGET carom_shared)
  list(APPEND CPACK_COMPONENTS_ALL Library)
endif()

set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

set(carom_debian_packages)
foreach(component IN LISTS carom_components)
  list(APPEND carom_debian_packages ${carom_${component}_debian})
endforeach()
list(REMOVE_DUPLICATES carom_debian_packages)
list(APPEND carom_debian_packages pkg-config)
set(carom_debian_library libcarom${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
if(TARGET carom_shared)
  list(APPEND carom_debian_packages "${carom_debian_library} (= ${PROJECT_VERSION}-1)")
endif()
list(JOIN carom_debian_packages ", " CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS)
# The first line of all descriptions is CPACK_PACKAGE_DESCRIPTION_SUMMARY.
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libcarom-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_DESCRIPTION
  "Development files: static libraries, headers, and files for CMake and\n\
pkg-config. A Bullet application attaches a Sound to its world and hears\n\
every collision, in pascals at the listener, at the instant it happened.")

set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME ${carom_debian_library})
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_LIBRARY_DESCRIPTION
  "The C interface: for programs in other languages, and for engines other\n\
than Bullet, which hand over events of their own.")

set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME carom)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SECTION sound)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_RUNTIME_DESCRIPTION
  "The carom command: renders scene files into WAV files, on mechanics of its\n\
own or on Bullet, and holds the two against each other. With a library of\n\
scenes.")

include(CPack)
