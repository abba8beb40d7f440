#include "command/list/scenes_command.h"

#include <algorithm>
#include <string_view>

#include "command/command_line.h"
#include "command/library/scene_library.h"
#include "command/terminal/terminal.h"
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "modal/json/json_reader.h"
#include "scenes/format/scene_loader.h"

namespace carom::command {
namespace {

constexpr std::size_t kSceneNameWidth = 22;  // letters
constexpr std::size_t kShortestClause = 24;

/// A scene of the library, and what its file says of it.
struct DescribedScene {
  LibraryScene scene;
  std::string description;
  double duration = 0.0;  // s; 0: the file does not say
};

/// Reads the description without what the scene needs: meshes and heads.
DescribedScene describedScene(const LibraryScene& scene) {
  DescribedScene described{scene, {}, 0.0};
  const Result<std::string> text = scenes::readSceneText(scene.file);
  if (!text) return described;
  const nlohmann::json file = nlohmann::json::parse(*text, nullptr, false);
  if (!file.is_object()) return described;
  const auto description = file.find("description");
  if (description != file.end() && description->is_string())
    described.description = description->get<std::string>();
  const auto duration = file.find("duration");
  if (duration != file.end() && duration->is_number()) described.duration = duration->get<double>();
  return described;
}

/// Returns the first sentence, or as many clauses of it as fit into `width` letters.
std::string lineOf(const std::string& description, std::size_t width) {
  std::string line = description.substr(0, description.find(". "));
  if (line.size() <= width) return line.ends_with('.') ? line.substr(0, line.size() - 1) : line;
  for (std::size_t clause = width; clause > kShortestClause; --clause)
    if (line[clause] == ',' || line[clause] == ':' || line[clause] == ';' || line[clause] == '(')
      return line.substr(0, line[clause] == '(' ? clause - 1 : clause);
  const std::size_t end = line.find_last_of(' ', width - 3);
  line.erase(end == std::string::npos ? width - 3 : end);
  while (line.ends_with(',') || line.ends_with(':') || line.ends_with(';') || line.ends_with(' '))
    line.pop_back();
  return line + "...";
}

nlohmann::ordered_json jsonOf(const DescribedScene& described) {
  nlohmann::ordered_json object;
  object["name"] = described.scene.name;
  object["file"] = described.scene.file.string();
  object["description"] = described.description;
  object["duration_s"] = nullptr;
  if (described.duration > 0.0) object["duration_s"] = described.duration;
  return object;
}

}  // namespace

ScenesCommand::ScenesCommand(CLI::App& app)
    : command_(app.add_subcommand(
          "scenes",
          "List the scenes of the library\n"
          "Every command that takes a SCENE takes these names. Their files may be copied and "
          "changed: docs/scenes.md says what stands in them.")) {
  command_->add_option("NAME", names_, "only these")->type_name("SCENE");
  command_->add_flag("--paths", paths_, "print where the files are, and nothing else");
  command_->add_flag("--json", json_, "print one JSON object instead of text");
  command_->footer(
      "Examples:\n"
      "  carom scenes\n"
      "  cp \"$(carom scenes --paths two_balls)\" mine.json\n"
      "\n"
      "With -q only the names are printed.\n");
}

bool ScenesCommand::parsed() const {
  return command_->parsed();
}

int ScenesCommand::run() const {
  std::vector<LibraryScene> scenes = libraryScenes();
  std::vector<std::string_view> known;
  for (const LibraryScene& scene : scenes)
    known.emplace_back(scene.name);
  for (const std::string& name : names_)
    if (std::ranges::find(known, name) == known.end())
      return fail(kBadInput, "no scene of the library is called " + modal::inQuotes(name) +
                                 modal::suggestion(name, known) + "; 'carom scenes' lists them");
  if (!names_.empty())
    std::erase_if(scenes, [this](const LibraryScene& scene) {
      return std::ranges::find(names_, scene.name) == names_.end();
    });
  if (scenes.empty())
    return fail(kFailed, "the library of scenes is not there; expected it in share/carom/scenes");
  const bool isBrief = talk().isQuiet() && !json_;
  talk().verbosity = Verbosity::normal;  // the names are what was asked for
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  std::string text;
  for (const LibraryScene& scene : scenes) {
    if (isBrief || paths_) {
      text += (paths_ ? scene.file.string() : scene.name) + '\n';
      continue;
    }
    const DescribedScene described = describedScene(scene);
    if (json_) {
      list.push_back(jsonOf(described));
      continue;
    }
    std::string name = scene.name;
    name.resize(std::max(name.size() + 2, kSceneNameWidth), ' ');
    text += styled(name, Style::name, Stream::out) +
            lineOf(described.description, textWidth() - name.size()) + '\n';
  }
  if (json_ && !paths_) return answer(jsonText({{"scenes", list}}));
  return answer(text);
}

}  // namespace carom::command
