#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "carom/audio/result.h"
#include "scenes/format/scene.h"

namespace carom::scenes {

/// Limits of the size of a scene. docs/scenes.md lists the range of every field.
struct SceneLimits {
  static constexpr std::uintmax_t kFileSize = std::uintmax_t{16} << 20U;  ///< bytes
  static constexpr std::size_t kSpheres = 100'000;  ///< including those of groups
  static constexpr std::size_t kPlanes = 1000;      ///< six for each box
  static constexpr std::size_t kBlocks = 1000;
  static constexpr std::size_t kSolids = 1000;
  static constexpr std::size_t kListeners = 256;
};

/// Which files a scene may name.
struct FileAccess {
  /// For scenes of strangers: every file that the scene names has to be in its folder or below it,
  /// once symbolic links are followed. What a glTF file names has to be below that file, always.
  bool confined = false;
  /// If set, this is the scene's folder, not that of its file.
  std::optional<std::filesystem::path> folder = {};
};

/// Reads a scene file. An error names the file, the place as a JSON pointer (or line and column
/// where it is not JSON), what is wrong there, and what would be accepted. The same file gives the
/// same scene, bit for bit, on every platform with IEEE doubles. Never throws for bad input.
/// [any thread]
Result<Scene> loadScene(const std::filesystem::path& file, const FileAccess& access = {});

/// Reads the text of a scene file unchanged. Errors: a file that does not exist, is not regular or
/// cannot be read.
Result<std::string> readSceneText(const std::filesystem::path& file);

/// Reads a scene from text in memory. `name` stands for the file: it begins messages, its stem is
/// the scene's name if the text gives none, and files that the scene names are relative to its
/// folder. Meshes are read; heads are not opened, only looked for. [any thread]
Result<Scene> parseScene(std::string_view text, std::string_view name,
                         const FileAccess& access = {});

/// True for the error of a scene that was refused because bodies overlap at its start. [any thread]
bool isOverlap(const Error& error);

}  // namespace carom::scenes
