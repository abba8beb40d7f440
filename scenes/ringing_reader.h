#pragma once

#include <filesystem>
#include <optional>

#include "scenes/json_reader.h"
#include "scenes/scene.h"

namespace carom::scenes {

/// What `entry`, a body, says under "modes" of how it rings; nothing, if it has no such member.
/// Names of files are relative to `folder`. Every error is recorded at its node. [any thread]
std::optional<Ringing> readRinging(const JsonNode& entry, const std::filesystem::path& folder);

}  // namespace carom::scenes
