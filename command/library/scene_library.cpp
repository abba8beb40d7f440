#include "command/library/scene_library.h"

#include <algorithm>
#include <set>
#include <sstream>
#include <string_view>

#include <CLI/CLI.hpp>

#include "modal/json/json_reader.h"

namespace carom::command {

namespace fs = std::filesystem;

namespace {

/// Returns the folders in which the library may be, by the place of this program.
std::vector<fs::path> libraryFolders() {
  std::error_code ignored;
  const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
  std::vector<fs::path> folders;
  std::istringstream names(CAROM_SCENE_FOLDERS);
  for (std::string name; std::getline(names, name, ':');)
    folders.push_back((program.parent_path() / name).lexically_normal());
  return folders;
}

bool exists(const std::string& name) {
  std::error_code ignored;
  return fs::exists(fs::symlink_status(name, ignored));
}

}  // namespace

std::vector<LibraryScene> libraryScenes() {
  std::vector<LibraryScene> scenes;
  std::set<std::string> names;
  for (const fs::path& folder : libraryFolders()) {
    std::error_code failed;
    for (fs::directory_iterator entry(folder, failed), end; !failed && entry != end;
         entry.increment(failed)) {
      const fs::path& file = entry->path();
      if (file.extension() == ".json" && names.insert(file.stem().string()).second)
        scenes.push_back({file.stem().string(), file});
    }
  }
  std::ranges::sort(scenes, {}, &LibraryScene::name);
  return scenes;
}

Result<std::string> sceneFile(const std::string& name) {
  const bool isPath = name.empty() || name.find('/') != std::string::npos;
  if (isPath || exists(name)) return name;
  const std::string plain = name.ends_with(".json") ? name.substr(0, name.size() - 5) : name;
  const std::vector<LibraryScene> scenes = libraryScenes();
  const auto found = std::ranges::find(scenes, plain, &LibraryScene::name);
  if (found != scenes.end()) return found->file.string();
  std::vector<std::string_view> names;
  for (const LibraryScene& scene : scenes)
    names.emplace_back(scene.name);
  return Error{name + ": no such file, and no scene of the library" +
               modal::suggestion(plain, names) +
               "; expected a file, or a name that 'carom scenes' lists"};
}

CLI::Validator sceneName() {
  return {[](std::string& text) -> std::string {
            const Result<std::string> file = sceneFile(text);
            if (!file) throw CLI::FileError(file.error().message);
            text = *file;
            return {};
          },
          "SCENE"};
}

}  // namespace carom::command
