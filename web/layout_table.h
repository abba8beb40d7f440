#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

#include "carom/carom.h"

namespace carom::web {

// The places of the C API's fields in memory, by the compiler of whoever includes this: a machine
// of 64 bits has others than WebAssembly. carom_h_tables.inc is made of carom.h
// (CHeaderTables.cmake).

/// The place of a field, or of an array of `count` elements.
struct PlacedField {
  const char* structName;
  const char* name;
  std::size_t offset;  ///< bytes
  /// "f64", "i32", "u32" or "u64": a double, or an integer of that size; pointers are integers.
  const char* kind;
  std::size_t count;
};

struct PlacedStruct {
  const char* name;
  std::size_t size;  ///< bytes
};

struct NamedConstant {
  const char* name;
  int value;
};

template <class Field>
constexpr const char* kindOf() {
  using Element = std::remove_all_extents_t<Field>;
  if constexpr (std::is_same_v<Element, double>) return "f64";
  if constexpr (std::is_same_v<Element, std::int32_t>) return "i32";
  static_assert(std::is_same_v<Element, double> || std::is_integral_v<Element> ||
                std::is_pointer_v<Element>);
  return sizeof(Element) == sizeof(std::uint32_t) ? "u32" : "u64";
}

template <class Field>
constexpr PlacedField placedField(const char* structName, const char* name, std::size_t offset) {
  return {structName, name, offset, kindOf<Field>(),
          sizeof(Field) / sizeof(std::remove_all_extents_t<Field>)};
}

/// The structs, fields and constants of carom.h, in its order.
#define CAROM_CONSTANT(constant)
#define CAROM_STRUCT(Struct)
#define CAROM_FIELD(Struct, member) \
  placedField<decltype(Struct::member)>(#Struct, #member, offsetof(Struct, member)),
inline const std::vector<PlacedField> kFields = {
#include "carom_h_tables.inc"
};
#undef CAROM_STRUCT
#undef CAROM_FIELD
#define CAROM_STRUCT(Struct) {#Struct, sizeof(Struct)},
#define CAROM_FIELD(Struct, member)
inline const std::vector<PlacedStruct> kStructs = {
#include "carom_h_tables.inc"
};
#undef CAROM_CONSTANT
#undef CAROM_STRUCT
#define CAROM_CONSTANT(constant) {#constant, constant},
#define CAROM_STRUCT(Struct)
inline const std::vector<NamedConstant> kConstants = {
#include "carom_h_tables.inc"
};
#undef CAROM_CONSTANT
#undef CAROM_STRUCT
#undef CAROM_FIELD

}  // namespace carom::web
