#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "carom/audio/result.h"

namespace carom::lab {

/// A file that a page holds, under the name that its scene has for it.
struct HeldFile {
  std::string name;
  std::vector<std::byte> bytes;
};

/// A scene that needs no files but those that it brings.
struct HeldScene {
  std::string text;  ///< JSON
  std::vector<HeldFile> files;
};

/// Makes a scene's text, which has been read without an error, one for a page that has no files.
/// Meshes become PLY files that the page holds, in metres, without texture coordinates. Normal
/// maps, models of modes and measured heads are left out: what they do to the sound is in the
/// page's run. Errors: a mesh that cannot be read any more.
Result<HeldScene> heldScene(const std::string& text, const std::filesystem::path& sceneFile);

}  // namespace carom::lab
