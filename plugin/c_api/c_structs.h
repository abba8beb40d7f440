#pragma once

#include <cstddef>
#include <string>
#include <type_traits>

#include "carom/audio/impulse_event.h"
#include "carom/audio/material.h"
#include "carom/audio/result.h"
#include "carom/audio/sound_body.h"
#include "carom/carom.h"
#include "carom/sound.h"

namespace carom::plugin {

// Converts the structs of carom.h into those of the library, and back. Errors name the field.
// [any thread]

/// Largest difference in size (bytes) between a struct here and one of another version: a larger
/// one means that the caller has not set the size.
inline constexpr std::size_t kMostGrowth = 4096;

/// Sizes (bytes) of a struct in the first version, and now.
struct StructSizes {
  std::size_t first;
  std::size_t now;
};

// Fields that were added since the first version are at the end.
template <class Struct>
inline constexpr StructSizes kSizes = {sizeof(Struct), sizeof(Struct)};
template <>
inline constexpr StructSizes kSizes<carom_settings> = {offsetof(carom_settings, ringing_bodies),
                                                       sizeof(carom_settings)};
template <>
inline constexpr StructSizes kSizes<carom_material> = {offsetof(carom_material, damping_alpha),
                                                       sizeof(carom_material)};
template <>
inline constexpr StructSizes kSizes<carom_statistics> = {offsetof(carom_statistics, rings),
                                                         sizeof(carom_statistics)};

/// Copies the known fields of a caller's struct, by its `size`; see carom.h on growth. Fields that
/// an older caller does not know stay as they are in `known`. Refuses sizes that no version has
/// had, and fields unknown here that are not zero.
Status readStruct(const void* given, void* known, StructSizes sizes, const char* name);
/// Fills the fields that the caller knows; those that are unknown here become zero.
Status writeStruct(const void* known, void* given, StructSizes sizes, const char* name);

/// Reads a caller's struct; `known` holds the defaults.
template <class Struct>
Result<Struct> readStruct(const Struct* given, Struct known, const char* name) {
  static_assert(std::is_trivially_copyable_v<Struct>);
  const Status read = readStruct(given, &known, kSizes<Struct>, name);
  if (!read) return read.error();
  return known;
}

template <class Struct>
Status writeStruct(const Struct& known, Struct* given, const char* name) {
  return writeStruct(&known, given, kSizes<Struct>, name);
}

/// Writes a struct whose size only the caller knows, and sets its `size`.
template <class Struct>
Status initStruct(const Struct& known, Struct* given, std::size_t size, const char* name) {
  if (given == nullptr) return Error{std::string(name) + " is NULL"};
  if (size >= sizeof(std::size_t)) given->size = size;
  return writeStruct(known, given, name);
}

carom_settings defaultSettings();
carom_listener defaultListener();
carom_body defaultBody();
carom_event defaultEvent();

/// The settings of a carom_settings.
struct CSettings {
  SoundSettings sound;
  WorldSoundSettings world;
};

/// Reads settings; NULL gives the defaults.
Result<CSettings> settingsFrom(const carom_settings* given);
Result<ImpulseEvent> eventFrom(const carom_event* given);
Result<Material> materialFrom(const carom_material* given);
Result<Material> materialNamed(const char* name);
/// Converts a built-in material, whose name lives for ever.
carom_material toC(const Material& material);
carom_statistics toC(const SoundStatistics& statistics);

}  // namespace carom::plugin
