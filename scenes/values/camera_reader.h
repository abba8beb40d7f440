#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "carom/audio/result.h"
#include "carom/audio/vector.h"
#include "modal/json/json_reader.h"
#include "scenes/values/camera_key.h"

namespace carom::scenes {

/// Most key frames of a camera.
inline constexpr std::size_t kMaxCameraKeys = 1000;

/// Reads a list of key frames, the "camera" of a scene with that gravity; every error is recorded
/// at its node. docs/scenes.md has the fields. [any thread]
std::vector<CameraKey> readCamera(const modal::JsonNode& node, const Vec3& gravity);

/// Reads a file that holds such a list. An error names the file, the place and what would be
/// accepted. [any thread]
Result<std::vector<CameraKey>> loadCamera(const std::filesystem::path& file, const Vec3& gravity);

}  // namespace carom::scenes
