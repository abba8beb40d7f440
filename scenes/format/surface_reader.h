#pragma once

#include <filesystem>
#include <optional>

#include "modal/json/json_reader.h"
#include "scenes/format/scene.h"
#include "scenes/format/scene_folder.h"

namespace carom::scenes {

/// Reads the "roughness" of a material or a body; returns `absent` if there is none. [any thread]
Roughness readRoughness(const modal::JsonNode& node, const Roughness& absent);

/// Reads the "normal_map" of a body; its file is relative to `folder`, and must exist. Without a
/// "size", it lies by the texture coordinates of a mesh; that the body has them is not checked
/// here. [any thread]
std::optional<NormalMapFile> readNormalMapEntry(const modal::JsonNode& entry,
                                                const SceneFolder& folder);

}  // namespace carom::scenes
