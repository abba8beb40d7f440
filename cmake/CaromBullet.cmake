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

macro(carom_find_bullet)
  carom_import_bullet(${CAROM_BULLET_PRECISION} carom_bullet_dependency)
endmacro()
