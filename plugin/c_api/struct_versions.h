#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <type_traits>

#include "carom/audio/result.h"
#include "carom/audio/vector.h"
#include "carom/carom.h"

namespace carom::plugin {

// Copies structs of carom.h between versions of the library, by their size; see carom.h on growth.
// Errors name the struct or the field. [any thread]

/// Largest difference in size (bytes) between a struct here and one of another version: a larger
/// one means that the caller has not set the size.
inline constexpr std::size_t kMostGrowth = 4096;

/// Sizes (bytes) of a struct in all versions, ascending; the last is that of this version. Fields
/// that a version added begin where the size of the one before ends.
template <class Struct>
inline constexpr std::array kSizes = {sizeof(Struct)};
template <>
inline constexpr std::array kSizes<carom_listener> = {
    offsetof(carom_listener, sofa_file), offsetof(carom_listener, head), sizeof(carom_listener)};
template <>
inline constexpr std::array kSizes<carom_settings> = {
    offsetof(carom_settings, ringing_bodies), offsetof(carom_settings, sliding_contacts),
    offsetof(carom_settings, on_message), offsetof(carom_settings, air_temperature),
    sizeof(carom_settings)};
template <>
inline constexpr std::array kSizes<carom_reverb> = {offsetof(carom_reverb, decay_time_16khz),
                                                    sizeof(carom_reverb)};
template <>
inline constexpr std::array kSizes<carom_material> = {
    offsetof(carom_material, damping_alpha), offsetof(carom_material, roughness),
    offsetof(carom_material, loss_factor), offsetof(carom_material, thermal_expansion),
    sizeof(carom_material)};
template <>
inline constexpr std::array kSizes<carom_body> = {offsetof(carom_body, modes), sizeof(carom_body)};
template <>
inline constexpr std::array kSizes<carom_event> = {offsetof(carom_event, other_position),
                                                   sizeof(carom_event)};
template <>
inline constexpr std::array kSizes<carom_statistics> = {
    offsetof(carom_statistics, rings), offsetof(carom_statistics, slides),
    offsetof(carom_statistics, peak), offsetof(carom_statistics, heard), sizeof(carom_statistics)};

/// Returns the `size` in a caller's struct, whatever its version.
std::size_t sizeOf(const void* callers);

/// Copies the known fields of a caller's struct, by its `size`. Fields that an older caller does
/// not know stay as they are in `known`. Refuses sizes that no version has had, and fields unknown
/// here that are not zero.
Status readStruct(const void* input, void* known, std::span<const std::size_t> sizes,
                  const char* name);
/// Fills the fields that the caller knows; those that are unknown here become zero.
Status writeStruct(const void* known, void* output, std::span<const std::size_t> sizes,
                   const char* name);

/// Reads a caller's struct; `known` holds the defaults.
template <class Struct>
Result<Struct> readStruct(const Struct* input, Struct known, const char* name) {
  static_assert(std::is_trivially_copyable_v<Struct>);
  const Status read = readStruct(input, &known, kSizes<Struct>, name);
  if (!read) return read.error();
  return known;
}

template <class Struct>
Status writeStruct(const Struct& known, Struct* output, const char* name) {
  return writeStruct(&known, output, kSizes<Struct>, name);
}

/// Writes a struct whose size only the caller knows, and sets its `size`.
template <class Struct>
Status initStruct(const Struct& known, Struct* output, std::size_t size, const char* name) {
  if (output == nullptr) return Error{std::string(name) + " is NULL"};
  if (size >= sizeof(std::size_t)) output->size = size;
  return writeStruct(known, output, name);
}

/// Returns a struct with its size set and all other fields zero.
template <class Struct>
Struct zeroed() {
  Struct made = {};
  made.size = sizeof made;
  return made;
}

/// A field with a value from 0 to count - 1; the count of a reserved field is 1.
struct Choice {
  const char* field;
  std::int32_t value;
  std::int32_t count;
};

/// Refuses the first of the fields that is out of its range.
Status checkChoices(std::initializer_list<Choice> choices);

/// Returns the element of a caller's array of structs, which lie as far apart as the first is
/// large.
template <class Struct>
const Struct* elementOf(const Struct* first, std::size_t index) {
  const auto* const bytes = reinterpret_cast<const std::byte*>(first);
  return reinterpret_cast<const Struct*>(bytes + index * sizeOf(first));
}

inline Vec3 vectorFrom(const double (&input)[3]) {
  return {input[0], input[1], input[2]};
}

/// Converts x, y, z, w.
inline Quat quaternionFrom(const double (&input)[4]) {
  return {input[3], input[0], input[1], input[2]};
}

}  // namespace carom::plugin
