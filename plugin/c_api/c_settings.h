#pragma once

#include "carom/audio/absorption.h"
#include "carom/audio/room.h"
#include "carom/carom.h"
#include "carom/sound.h"
#include "plugin/c_api/struct_versions.h"

namespace carom::plugin {

// Settings of carom.h: listeners, rooms and reverberation, and all of carom_settings. Errors name
// the field; values out of range that the library itself refuses are left to it. [any thread]

/// The settings of a carom_settings.
struct CSettings {
  SoundSettings sound;
  WorldSoundSettings world;
};

carom_settings defaultSettings();
carom_listener defaultListener();
carom_room defaultRoom();
carom_reflector defaultReflector();
carom_reverb defaultReverb();

/// Reads settings; NULL gives the defaults. Loads the heads of listeners from their files.
Result<CSettings> settingsFrom(const carom_settings* input);
Result<Room> roomFrom(const carom_room* input);
Result<ReverbSettings> reverbFrom(const carom_reverb* input);
carom_reverb toC(const ReverbSettings& reverb);

/// Returns the built-in surface of that name.
Result<const Surface*> surfaceNamed(const char* name);
carom_surface toC(const Surface& surface);

}  // namespace carom::plugin
