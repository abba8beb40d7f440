# Debian ships Bullet twice, in float and in double, told apart by pkg-config module and one macro.
# carom_find_bullet() defines carom_bullet_dependency for CAROM_BULLET_PRECISION; carom_import_bullet() any one.

function(carom_import_bullet precision target)
  if(precision STREQUAL "float")
    set(module bullet)
  elseif(precision STREQUAL "double")
    set(module bullet-float64)
  else()
    message(FATAL_ERROR "CAROM_BULLET_PRECISION is '${precision}'; it takes float or double")
  endif()
  carom_find_library(${target} ${module} NAME "Bullet (${precision})" PACKAGE libbullet-dev
    WITHOUT "Bullet: -DCAROM_BULLET=OFF -DCAROM_PLUGIN=OFF -DCAROM_SCENES=OFF")
endfunction()

# No distribution has Bullet for WebAssembly. The page's engine is built of Bullet's source, in the precision that is
# Bullet's default, and of all of it: the linker leaves out what is not used.
set(CAROM_BULLET_SOURCE "" CACHE PATH
  "Folder with the source of Bullet 3.24, for the page's engine; if empty, web/get_bullet.sh fetches Debian's")

# `folder` becomes the one that has LinearMath/ in it; empty if there is none.
function(carom_find_bullet_source folder)
  set(found ${CAROM_BULLET_SOURCE})
  if(NOT found)
    set(found ${CMAKE_BINARY_DIR}/bullet)
    if(NOT EXISTS ${found}/btLinearMathAll.cpp)
      message(STATUS "Carom: fetching Bullet's source with apt-get")
      execute_process(COMMAND ${PROJECT_SOURCE_DIR}/web/get_bullet.sh ${found}
        OUTPUT_QUIET ERROR_VARIABLE why ERROR_STRIP_TRAILING_WHITESPACE)
    endif()
  elseif(EXISTS ${found}/src/btLinearMathAll.cpp)
    set(found ${found}/src)
  endif()
  if(NOT EXISTS ${found}/btLinearMathAll.cpp)
    if(CAROM_BULLET_SOURCE)
      message(FATAL_ERROR "CAROM_BULLET_SOURCE is '${CAROM_BULLET_SOURCE}', which has no btLinearMathAll.cpp, nor has its src/")
    endif()
    message(STATUS "Carom: no source of Bullet (${why}), so the page runs scenes of the native stepper alone; "
      "-DCAROM_BULLET_SOURCE=FOLDER names another")
    set(found "")
  endif()
  set(${folder} ${found} PARENT_SCOPE)
endfunction()

function(carom_build_bullet folder)
  add_library(carom_bullet_from_source STATIC
    ${folder}/btLinearMathAll.cpp ${folder}/btBulletCollisionAll.cpp ${folder}/btBulletDynamicsAll.cpp)
  add_library(PkgConfig::carom_bullet_dependency ALIAS carom_bullet_from_source)
  target_include_directories(carom_bullet_from_source SYSTEM PUBLIC ${folder})
  target_compile_options(carom_bullet_from_source PRIVATE -w -ffp-contract=off)
  set_target_properties(carom_bullet_from_source PROPERTIES UNITY_BUILD OFF)
endfunction()

macro(carom_find_bullet)
  if(CAROM_WEB)
    carom_find_bullet_source(carom_bullet_folder)
    if(carom_bullet_folder)
      carom_build_bullet(${carom_bullet_folder})
    else()
      set(CAROM_BULLET OFF)
    endif()
  else()
    carom_import_bullet(${CAROM_BULLET_PRECISION} carom_bullet_dependency)
  endif()
endmacro()
