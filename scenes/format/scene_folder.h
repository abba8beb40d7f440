#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "modal/json/json_reader.h"

namespace carom::scenes {

/// The folder that the names of files in a scene are relative to. [any thread]
struct SceneFolder {
  std::filesystem::path path;
  /// Refuses names that lead out of the folder: absolute ones, "..", and symbolic links.
  bool confined = false;
  /// The files that were named so far, in this folder and its copies.
  std::shared_ptr<std::vector<std::filesystem::path>> named =
      std::make_shared<std::vector<std::filesystem::path>>();

  /// Returns the path of the file that `node` names; records an error if it leads out of a confined
  /// folder. The file need not be there.
  std::filesystem::path fileOf(const modal::JsonNode& node) const;
};

}  // namespace carom::scenes
