#pragma once

#include <filesystem>
#include <optional>

#include "scenes/json_reader.h"
#include "scenes/scene.h"

namespace carom::scenes {

/// The "roughness" of a material or a body; `absent` where it says nothing. [any thread]
Roughness readRoughness(const JsonNode& node, const Roughness& absent);

/// The "normal_map" of a body; its file is relative to `folder`, and has to be there. Without a
/// "size" it is meant to lie as a mesh says, whether or not the body has one. [any thread]
std::optional<NormalMapFile> readNormalMapEntry(const JsonNode& entry,
                                                const std::filesystem::path& folder);

}  // namespace carom::scenes
