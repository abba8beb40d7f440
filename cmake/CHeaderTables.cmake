# carom_c_header_tables(HEADER OUTPUT): writes what a C header declares as three lists of macros, for a source that
# gives them a meaning: CAROM_CONSTANT(name) for each enumerator, CAROM_STRUCT(name) for each struct, each followed by
# CAROM_FIELD(struct, field) for each of its fields.
function(carom_c_header_tables header output)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${header})
  file(READ ${header} text)
  string(REGEX REPLACE "//[^\n]*" "" text "${text}")
  string(REGEX REPLACE "[ \n]+" " " text "${text}")
  set(tables)

  string(REGEX MATCHALL "enum { [^}]*}" enumerations "${text}")
  foreach(enumeration IN LISTS enumerations)
    string(REGEX MATCHALL "CAROM_[A-Z0-9_]+ =" constants "${enumeration}")
    foreach(constant IN LISTS constants)
      string(REGEX REPLACE " =$" "" constant "${constant}")
      string(APPEND tables "CAROM_CONSTANT(${constant})\n")
    endforeach()
  endforeach()

  string(REPLACE ";" "@" text "${text}")  # which would part CMake's lists
  string(REGEX MATCHALL "typedef struct [a-z_]+ { [^}]*}" structs "${text}")
  foreach(struct IN LISTS structs)
    string(REGEX MATCH "typedef struct ([a-z_]+) { " start "${struct}")
    set(name ${CMAKE_MATCH_1})
    string(APPEND tables "CAROM_STRUCT(${name})\n")
    string(REGEX MATCHALL "[a-z0-9_]+(\\[[A-Z0-9_]+\\])?@" fields "${struct}")
    foreach(field IN LISTS fields)
      string(REGEX REPLACE "(\\[.*)?@$" "" field "${field}")
      string(APPEND tables "CAROM_FIELD(${name}, ${field})\n")
    endforeach()
  endforeach()
  file(CONFIGURE OUTPUT ${output} CONTENT "${tables}" @ONLY)
endfunction()
