# What `cmake --install` puts where, and what find_package and pkg-config are told about it.
# Install components: Development for who builds against Carom, Library for who links libcarom.so,
# Runtime for who runs the command, Documentation for who reads. debian/ makes packages of them.
#
#   include/carom/*.h            of plugin/: what a host includes, as <carom/sound.h>
#   include/carom/<layer>/*.h    what these include, and the other layers' own: <carom/audio/synth.h>
#   lib/libcarom_<layer>.a, lib/cmake/carom/, lib/pkgconfig/carom*.pc
#   lib/libcarom.so*             the C interface, if it is built as a shared library
#   lib/carom/                   plugins that others load, and what `carom listen` brings to a program
#   bin/carom, share/carom/scenes/
#   share/doc/carom/             README.md and docs/, which say of which version they are; examples/, which
#                                are built against what is installed
#   share/man/man1/carom*.1, share/bash-completion/, share/zsh/, share/fish/: made by the program itself
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# The libraries that layers may link: CMake target; how a consumer's CMake finds it; how its pkg-config
# does, a module or flags for the linker; its Debian package, which debian/control names for libcarom-dev.
# "pkg" by pkg-config, "package ARGUMENTS" by find_package with : for spaces, "library" as the file
# that the flags name first, of what has neither.
set(carom_pc_bullet bullet)
if(CAROM_BULLET_PRECISION STREQUAL "double")
  set(carom_pc_bullet bullet-float64)
endif()
set(carom_dependency_table
  "Eigen3::Eigen|package Eigen3:3.4:NO_MODULE|eigen3|libeigen3-dev (>= 3.4)"
  "Threads::Threads|package Threads||"
  "PkgConfig::carom_sndfile|pkg|sndfile|libsndfile1-dev"
  "PkgConfig::carom_mysofa|pkg|libmysofa|libmysofa-dev"
  "PkgConfig::carom_png|pkg|libpng|libpng-dev"
  "PkgConfig::carom_zstd|pkg|libzstd|libzstd-dev"
  "PkgConfig::carom_highway|pkg|libhwy|libhwy-dev"
  "PkgConfig::carom_assimp|pkg|assimp|libassimp-dev"
  "meshoptimizer::meshoptimizer|package meshoptimizer|-lmeshoptimizer|libmeshoptimizer-dev"
  "carom_mumps|library|-ldmumps_seq -ldl|libmumps-seq-dev"
  "PkgConfig::carom_sdl2|pkg|sdl2|libsdl2-dev"
  "PkgConfig::carom_bullet_dependency|pkg|${carom_pc_bullet}|libbullet-dev")

# In the order of the layers, lowest first.
set(carom_components)
foreach(component audio modal native bullet plugin)
  if(TARGET carom_${component})
    list(APPEND carom_components ${component})
  endif()
endforeach()

set(carom_audio_description "Physically based contact sound: from impulse events to pressure")
set(carom_modal_description "The modes of meshes, and how they radiate, for Carom")
set(carom_native_description "Event-driven reference mechanics for Carom")
set(carom_bullet_description "Impulse events with exact times from Bullet worlds")
set(carom_plugin_description "Contact sound for Bullet applications")
set(carom_shared_description "The C interface of Carom as a shared library")

# Sorts what carom_<component> links, its own PUBLIC and PRIVATE libraries, into
# carom_<component>_<below|packages|modules|files|requires|flags|debian>.
function(carom_sort_dependencies component)
  foreach(list below packages modules files requires flags debian)
    set(${list})
  endforeach()
  get_target_property(libraries carom_${component} LINK_LIBRARIES)
  foreach(library IN LISTS libraries)
    if(library MATCHES "^carom::(.+)$")
      list(APPEND below ${carom_${CMAKE_MATCH_1}_below} ${CMAKE_MATCH_1})
      list(APPEND requires carom-${CMAKE_MATCH_1})
      continue()
    elseif(library MATCHES "^[$]<BUILD_INTERFACE:")  # headers that only the sources include
      continue()
    endif()
    set(rows ${carom_dependency_table})
    string(REGEX REPLACE "([][+.*()^])" "\\\\\\1" pattern "${library}")
    list(FILTER rows INCLUDE REGEX "^${pattern}[|]")
    if(NOT rows)
      message(FATAL_ERROR "carom_${component} links ${library}, and cmake/CaromInstall.cmake does not "
        "know how a consumer finds it: add it to carom_dependency_table")
    endif()
    string(REPLACE "|" ";" row "${rows}")
    list(GET row 1 how)
    list(GET row 2 module)
    list(GET row 3 package)
    if(how STREQUAL "pkg")
      string(REPLACE "PkgConfig::" "" target ${library})
      list(APPEND modules ${target}=${module})
    elseif(how STREQUAL "library")
      string(REGEX MATCH "^-l([^ ]+)" file "${module}")
      list(APPEND files ${library}=${CMAKE_MATCH_1})
    else()
      string(REPLACE "package " "" how ${how})
      list(APPEND packages ${how})
    endif()
    if(module MATCHES "^-l")
      list(APPEND flags ${module})
    else()
      list(APPEND requires ${module})
    endif()
    list(APPEND debian ${package})
  endforeach()
  list(REMOVE_DUPLICATES below)
  foreach(list below packages modules files requires flags debian)
    set(carom_${component}_${list} "${${list}}" PARENT_SCOPE)
  endforeach()
endfunction()

# ---- libraries and headers

set(carom_cmake_folder ${CMAKE_INSTALL_LIBDIR}/cmake/carom)
set(carom_pc_folder ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
foreach(component IN LISTS carom_components)
  set_target_properties(carom_${component} PROPERTIES EXPORT_NAME ${component})
  install(TARGETS carom_${component} EXPORT carom-${component}-targets
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT Development
    FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT Development
    INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})  # for a consumer's CMake before 3.23, which knows no file sets
  install(EXPORT carom-${component}-targets NAMESPACE carom:: DESTINATION ${carom_cmake_folder}
    COMPONENT Development)
  carom_sort_dependencies(${component})
endforeach()

# The C interface: a shared library, with all that it needs inside or found by the loader.
if(TARGET carom_shared)
  set_target_properties(carom_shared PROPERTIES EXPORT_NAME shared)
  install(TARGETS carom_shared EXPORT carom-shared-targets
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT Library NAMELINK_COMPONENT Development
    INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
  install(EXPORT carom-shared-targets NAMESPACE carom:: DESTINATION ${carom_cmake_folder}
    COMPONENT Development)
  list(APPEND carom_components shared)
endif()
if(TARGET carom_pybullet)
  install(TARGETS carom_pybullet
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/carom COMPONENT Runtime)
  install(FILES ${PROJECT_SOURCE_DIR}/plugin/pybullet/python/carom.py
    DESTINATION ${CMAKE_INSTALL_LIBDIR}/carom COMPONENT Runtime)
endif()
if(TARGET carom_listen_preload)
  install(TARGETS carom_listen_preload carom_listen_float carom_listen_double
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/carom COMPONENT Runtime)
endif()

# ---- find_package

set(carom_config_component_tables)
foreach(component IN LISTS carom_components)
  foreach(list below packages modules files)
    string(APPEND carom_config_component_tables
      "set(_carom_${list}_${component} ${carom_${component}_${list}})\n")
  endforeach()
endforeach()
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/carom-config.cmake.in
  ${PROJECT_BINARY_DIR}/install/carom-config.cmake INSTALL_DESTINATION ${carom_cmake_folder})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/install/carom-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/install/carom-config.cmake
  ${PROJECT_BINARY_DIR}/install/carom-config-version.cmake
  DESTINATION ${carom_cmake_folder} COMPONENT Development)

# ---- pkg-config. The libraries are static and nothing else: what they need is in Requires, not in
# Requires.private, so that `pkg-config --libs` links without --static, which would pull in all that
# libsndfile and SDL are made of.

# From the .pc file's folder, so that the tree can be moved; absolute folders stay as they are.
function(carom_pc_path variable folder)
  if(IS_ABSOLUTE "${folder}")
    set(${variable} "${folder}" PARENT_SCOPE)
  else()
    set(${variable} "\${prefix}/${folder}" PARENT_SCOPE)
  endif()
endfunction()
carom_pc_path(carom_pc_libdir "${CMAKE_INSTALL_LIBDIR}")
carom_pc_path(carom_pc_includedir "${CMAKE_INSTALL_INCLUDEDIR}")
file(RELATIVE_PATH carom_pc_to_prefix ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})
string(REGEX REPLACE "/$" "" carom_pc_to_prefix "${carom_pc_to_prefix}")

set(carom_pc_all)
foreach(component IN LISTS carom_components)
  set(carom_pc_library carom_${component})
  set(carom_pc_cflags "-I\${includedir}")
  if(component STREQUAL "shared")
    set(carom_pc_library carom)
    set(carom_pc_cflags "-I\${includedir} -DCAROM_SHARED")
  else()  # either the static ones or the shared one: both hold the same
    list(APPEND carom_pc_all carom-${component})
  endif()
  list(JOIN carom_${component}_requires " " carom_pc_requires)
  list(TRANSFORM carom_${component}_flags PREPEND " ")
  list(JOIN carom_${component}_flags "" carom_pc_flags)
  set(carom_pc_description ${carom_${component}_description})
  configure_file(${PROJECT_SOURCE_DIR}/cmake/carom-component.pc.in
    ${PROJECT_BINARY_DIR}/install/carom-${component}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/install/carom-${component}.pc
    DESTINATION ${carom_pc_folder} COMPONENT Development)
endforeach()
list(JOIN carom_pc_all " " carom_pc_requires)
configure_file(${PROJECT_SOURCE_DIR}/cmake/carom.pc.in ${PROJECT_BINARY_DIR}/install/carom.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/install/carom.pc DESTINATION ${carom_pc_folder}
  COMPONENT Development)

# ---- the command, and its scenes

if(TARGET carom)
  install(TARGETS carom RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT Runtime)
  # The files that scenes name lie beside them as in the sources; what made these stays there.
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/scenes/library/ ${PROJECT_SOURCE_DIR}/scenes/shows/
    DESTINATION ${CMAKE_INSTALL_DATADIR}/carom/scenes COMPONENT Runtime
    FILES_MATCHING PATTERN "*.json" PATTERN "*.obj" PATTERN "*.png" PATTERN "*.w")
  if(NOT CMAKE_CROSSCOMPILING)  # command/CMakeLists.txt makes them
    install(DIRECTORY ${PROJECT_BINARY_DIR}/share/man/
      DESTINATION ${CMAKE_INSTALL_MANDIR} COMPONENT Runtime)
    install(DIRECTORY ${PROJECT_BINARY_DIR}/share/bash-completion ${PROJECT_BINARY_DIR}/share/zsh
      ${PROJECT_BINARY_DIR}/share/fish DESTINATION ${CMAKE_INSTALL_DATADIR} COMPONENT Runtime)
  endif()
  install(FILES ${PROJECT_SOURCE_DIR}/scenes/scene.schema.json
    DESTINATION ${CMAKE_INSTALL_DATADIR}/carom COMPONENT Runtime)
endif()

# ---- documentation and examples

set(carom_doc_folder ${CMAKE_INSTALL_DATADIR}/doc/carom)

# carom_versioned_page(FILE): a page of the repository with the version below its title.
function(carom_versioned_page file)
  file(READ ${PROJECT_SOURCE_DIR}/${file} page)
  set_property(DIRECTORY ${PROJECT_SOURCE_DIR} APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
  string(FIND "${page}" "\n" end)
  string(SUBSTRING "${page}" 0 ${end} title)
  if(NOT title MATCHES "^# ")
    message(FATAL_ERROR "${file} begins with '${title}', and not with a title, below which the version is installed")
  endif()
  string(SUBSTRING "${page}" ${end} -1 rest)
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/install/${file}
    CONTENT "@title@\n\nVersion @PROJECT_VERSION@.\n@rest@" @ONLY)
endfunction()

install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs DESTINATION ${carom_doc_folder} COMPONENT Documentation
  PATTERN "*.py" EXCLUDE PATTERN "*.sh" EXCLUDE)
install(FILES ${PROJECT_SOURCE_DIR}/CHANGELOG.md ${PROJECT_SOURCE_DIR}/CONTRIBUTING.md ${PROJECT_SOURCE_DIR}/LICENSE
  DESTINATION ${carom_doc_folder} COMPONENT Documentation)
foreach(page README.md docs/README.md)
  carom_versioned_page(${page})
  cmake_path(GET page PARENT_PATH folder)
  install(FILES ${PROJECT_BINARY_DIR}/install/${page} DESTINATION ${carom_doc_folder}/${folder}
    COMPONENT Documentation)
endforeach()

# With the CMake of an application, in place of the one that builds them of Carom's sources.
if(TARGET carom_plugin AND TARGET carom_bullet)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/plugin/examples DESTINATION ${carom_doc_folder} COMPONENT Documentation
    PATTERN CMakeLists.txt EXCLUDE PATTERN installed.cmake EXCLUDE PATTERN .clang-format EXCLUDE)
  install(FILES ${PROJECT_SOURCE_DIR}/plugin/examples/installed.cmake RENAME CMakeLists.txt
    DESTINATION ${carom_doc_folder}/examples COMPONENT Documentation)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/plugin/pybullet/python/examples/
    DESTINATION ${carom_doc_folder}/examples/pybullet COMPONENT Documentation FILES_MATCHING PATTERN "*.py")
endif()
