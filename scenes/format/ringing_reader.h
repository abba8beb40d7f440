#pragma once

#include <filesystem>
#include <optional>

#include "modal/json/json_reader.h"
#include "scenes/format/scene.h"
#include "scenes/format/scene_folder.h"

namespace carom::scenes {

/// Reads the member "modes" of `entry`, a body: how it rings. Returns nullopt if there is no such
/// member. Names of files are relative to `folder`. Every error is recorded at its node.
/// [any thread]
std::optional<Ringing> readRinging(const modal::JsonNode& entry, const SceneFolder& folder);

}  // namespace carom::scenes
