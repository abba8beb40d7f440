# One layer = one library: carom_layer(audio SOURCES ... DEPENDS ...) makes carom_audio, alias carom::audio.
function(carom_layer name)
  cmake_parse_arguments(ARG "" "EXPORT_NAME" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(carom_${name} STATIC ${ARG_SOURCES})
  add_library(carom::${name} ALIAS carom_${name})
  target_link_libraries(carom_${name} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE})
  carom_compile_options(carom_${name})
  # First of all, so that no folder of a host's own, named on every command line by its
  # include_directories(), can take the place of ours.
  target_include_directories(carom_${name} BEFORE
    PUBLIC $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>)
  carom_precompile_as_layer(carom_${name})
  carom_public_headers(${name})
endfunction()

# Gives the target what `owner`, a target made here for this alone, compiled once of `header`, which
# needs the libraries named last.
function(carom_precompile target owner header)
  if(NOT CAROM_PRECOMPILED_HEADERS)
    return()
  endif()
  # False alarms of GCC 12 about the standard library's strings, which it silences only where the
  # header that they are in was read as text. The builds without precompiled headers keep them.
  set(quiet)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    set(quiet -Wno-array-bounds -Wno-restrict -Wno-stringop-overflow -Wno-stringop-overread)
    # Each collection of garbage goes through all of the precompiled header: not before 2 GB.
    list(APPEND quiet --param=ggc-min-heapsize=2000000)
  endif()
  if(NOT TARGET ${owner})
    add_library(${owner} OBJECT ${PROJECT_SOURCE_DIR}/cmake/empty.cpp)
    target_link_libraries(${owner} PRIVATE ${ARGN})
    carom_compile_options(${owner})
    target_compile_options(${owner} PRIVATE ${quiet})
    target_precompile_headers(${owner} PRIVATE ${PROJECT_SOURCE_DIR}/${header})
  endif()
  target_compile_options(${target} PRIVATE ${quiet})
  target_precompile_headers(${target} REUSE_FROM ${owner})
endfunction()

# For executables, which are compiled for places of their own (-fPIE), and what they share with it.
function(carom_precompiled_for_executables owner)
  if(TARGET ${owner})
    target_compile_options(${owner} PRIVATE -fPIE)
    set_target_properties(${owner} PROPERTIES POSITION_INDEPENDENT_CODE OFF)
  endif()
endfunction()

# What is compiled as the libraries are.
function(carom_precompile_as_layer target)
  carom_precompile(${target} carom_precompiled cmake/precompiled.h Eigen3::Eigen)
endfunction()

# All headers below include/ are the layer's public ones: what a host may include, as <carom/...>,
# and what is installed.
function(carom_public_headers name)
  file(GLOB_RECURSE headers CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/include/*.h)
  target_sources(carom_${name} PUBLIC FILE_SET HEADERS
    BASE_DIRS ${CMAKE_CURRENT_SOURCE_DIR}/include FILES ${headers})
endfunction()

# A WebAssembly module is at one place for ever.
set(carom_position_independent ON)
if(CMAKE_SYSTEM_PROCESSOR STREQUAL "wasm32")
  set(carom_position_independent OFF)
endif()

# -ffp-contract=off everywhere: the same source gives the same bits at every optimisation level,
# and where a fused multiply-add is wanted it is written as one.
function(carom_host_options target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  set_target_properties(${target} PROPERTIES
    CXX_EXTENSIONS OFF CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON
    POSITION_INDEPENDENT_CODE ${carom_position_independent})
  target_compile_options(${target} PRIVATE
    -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wnon-virtual-dtor
    -Wold-style-cast -Woverloaded-virtual -ffp-contract=off -fno-math-errno
    $<$<BOOL:${CAROM_WARNINGS_AS_ERRORS}>:-Werror>)
  if(CMAKE_UNITY_BUILD)
    # GCC takes a source that another one includes for a header. To Clang, a name of one source shadows
    # what an earlier one keeps to itself.
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>
      $<$<CXX_COMPILER_ID:Clang>:-Wno-shadow>)
  endif()
endfunction()

# Within a host that names no build type, which compiles without optimisation then, our libraries are
# optimised all the same: contact sound at -O0 takes seventy times as long. A host that wants that
# asks for it with the build type Debug, or with an -O of its own in CMAKE_CXX_FLAGS.
set(carom_own_optimisation)
if(NOT PROJECT_IS_TOP_LEVEL AND NOT carom_multi_config AND NOT CMAKE_BUILD_TYPE
   AND NOT CMAKE_CXX_FLAGS MATCHES "(^| )-O")
  set(carom_own_optimisation -O2)
endif()

# Our own targets see private headers too, which are included by their place in the repository.
function(carom_compile_options target)
  carom_host_options(${target})
  target_compile_options(${target} PRIVATE ${carom_own_optimisation})
  target_compile_definitions(${target} PRIVATE CAROM_THREADS=$<BOOL:${CAROM_THREADS}>)
  target_include_directories(${target} BEFORE PRIVATE ${PROJECT_SOURCE_DIR})
endfunction()

# Of what is written in C, as a host would: C99, and nothing beyond.
function(carom_c_options target)
  set_target_properties(${target} PROPERTIES C_STANDARD 99 C_STANDARD_REQUIRED ON C_EXTENSIONS OFF)
  target_compile_options(${target} PRIVATE
    $<$<COMPILE_LANGUAGE:C>:-Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion
    $<$<BOOL:${CAROM_WARNINGS_AS_ERRORS}>:-Werror>>)
endfunction()

# PkgConfig::<target>, of a library that only pkg-config knows. Not found: says which Debian package
# has it, and how to build without.
function(carom_find_library target module)
  cmake_parse_arguments(ARG "" "NAME;PACKAGE;WITHOUT" "" ${ARGN})
  find_package(PkgConfig REQUIRED)
  pkg_check_modules(${target} QUIET IMPORTED_TARGET GLOBAL ${module})
  if(NOT ${target}_FOUND)
    message(FATAL_ERROR "${ARG_NAME} not found: pkg-config knows no '${module}'. "
      "On Debian: apt-get install ${ARG_PACKAGE}. To build without ${ARG_WITHOUT}")
  endif()
endfunction()
