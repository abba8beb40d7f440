#include "scenes/format/scene_folder.h"

#include <string>

#include "audio/io/byte_file.h"
#include "scenes/values/scene_ranges.h"

namespace carom::scenes {

std::filesystem::path SceneFolder::fileOf(const modal::JsonNode& node) const {
  const std::string name = node.text(kFileName);
  if (node.failed()) return {};
  std::filesystem::path file = path / name;
  if (confined && !audio::isBelow(file, path))
    node.fail(modal::inQuotes(name) +
              " leads out of the folder of the scene; expected a file in it or below it, as the "
              "scene is confined");
  named->push_back(file);
  return file;
}

}  // namespace carom::scenes
