#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "carom/audio/result.h"

namespace CLI {
class Validator;
}

namespace carom::command {

/// A scene of the library.
struct LibraryScene {
  std::string name;
  std::filesystem::path file;
};

/// Returns the scenes that are installed with this program, or in the sources that it was built
/// from, by name.
std::vector<LibraryScene> libraryScenes();

/// Returns the file of a scene that a command line names: itself if there is such a file, or if the
/// name is a path; that of the library's scene of the name, with or without .json, otherwise.
/// Errors: neither is there; the message begins with the name, and suggests the nearest.
Result<std::string> sceneFile(const std::string& name);

/// Replaces the name of a scene by its file. Throws CLI::FileError for those that are neither,
/// which is told as it is: not as a wrong use of the option.
CLI::Validator sceneName();

}  // namespace carom::command
