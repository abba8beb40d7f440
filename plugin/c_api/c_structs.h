#pragma once

#include <filesystem>

#include "carom/audio/contact_state.h"
#include "carom/audio/impulse_event.h"
#include "carom/audio/material.h"
#include "carom/audio/normal_map.h"
#include "carom/audio/surface_mesh.h"
#include "carom/carom.h"
#include "carom/sound.h"
#include "plugin/c_api/struct_versions.h"

namespace carom::plugin {

// Converts the structs of carom.h into those of the library, and back, but for settings
// (c_settings.h) and bodies of posted events (c_body.h). Errors name the field. [any thread]

/// Returns the path that a text of the C API names.
inline std::filesystem::path filePath(const char* utf8) {
  return {reinterpret_cast<const char8_t*>(utf8)};
}

carom_body defaultBody();
carom_body_sound defaultBodySound();
carom_event defaultEvent();
carom_contact defaultContact();
carom_roughness defaultRoughness();
carom_roughness toC(const Roughness& roughness);
carom_normal_map defaultNormalMap();

Result<ImpulseEvent> eventFrom(const carom_event* input);
Result<ContactState> contactFrom(const carom_contact* input);
Result<Roughness> roughnessFrom(const carom_roughness* input);
Result<Material> materialFrom(const carom_material* input);
Result<Material> materialNamed(const char* name);
/// Reads what Sound::assign takes.
Result<BodySound> bodySoundFrom(const carom_body_sound* input);
/// Reads settings of a normal map; NULL gives the defaults.
Result<NormalMapSettings> normalMapFrom(const carom_normal_map* input);
/// Reads a mesh. Refuses NULL, and counts that are a mistake; does not look at the triangles.
Result<SurfaceMesh> meshFrom(const carom_mesh& input);

/// Converts a built-in material, whose name and roughness live for ever.
carom_material toC(const Material& material);
carom_statistics toC(const SoundStatistics& statistics);
/// Converts all but the arrays, which are left NULL.
carom_collision toC(const SoundCollision& collision);

}  // namespace carom::plugin
