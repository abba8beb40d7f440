#include "command/listen_outcome.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "command/output/sound_name.h"
#include "lab/report/report_text.h"
#include <nlohmann/json.hpp>
#include <sndfile.h>

#include "audio/io/partial_file.h"
#include "carom/audio/synth_settings.h"
#include "plugin/listen/listen_protocol.h"

namespace carom::command {
namespace {

/// Fills in what the file itself says.
void lookAtFile(ListenedWorld& world) {
  SF_INFO info = {};
  const ReadFile file = openSound(world.file, info);
  if (file == nullptr || info.samplerate <= 0) {
    world.file.clear();
    return;
  }
  world.duration = static_cast<double>(info.frames) / info.samplerate;
  if (world.isComplete) world.fullScale = fullScaleIn(file.get());
}

bool hasSamples(const std::filesystem::path& path) {
  SF_INFO info = {};
  return openSound(path.string(), info) != nullptr && info.frames > 0;
}

/// Gives the file that a program has left in the midst of a recording a name. Nobody writes it any
/// more.
void keepPart(ListenedWorld& world) {
  const auto kept = audio::PartialFile::keepLeftovers(world.file, hasSamples);
  const std::filesystem::path folder = std::filesystem::path(world.file).parent_path();
  world.file = kept.empty() ? std::string() : (folder / kept.back().filename()).string();
}

void readLine(const std::string& line, ListenOutcome& outcome, std::vector<int>& numbers) {
  std::istringstream words(line);
  std::string kind;
  int number = 0;
  words >> kind;
  if (kind == "message") {
    const std::string sentence = line.substr(std::min(line.size(), kind.size() + 1));
    if (std::ranges::find(outcome.messages, sentence) == outcome.messages.end())
      outcome.messages.push_back(sentence);
    return;
  }
  words >> number;
  if (kind == "begin") {
    numbers.push_back(number);
    words >> outcome.worlds.emplace_back().precision;
    return;
  }
  const auto found = std::ranges::find(numbers, number);
  if (kind != "end" || found == numbers.end()) return;
  ListenedWorld& world = outcome.worlds[static_cast<std::size_t>(found - numbers.begin())];
  std::uint64_t events = 0;
  double peak = 0.0;
  if (!(words >> events >> peak)) return;
  world.isComplete = true;
  world.events = events;
  world.peak = peak;
}

std::string numberText(double number) {
  std::ostringstream text;
  text.precision(4);
  text << number;
  return text.str();
}

std::string lineFor(const ListenedWorld& world) {
  if (!world.isComplete)
    return world.file.empty()
               ? "the recording of a world is not complete, and has no file; its process may still "
                 "run\n"
               : world.file + ": " + numberText(world.duration) +
                     " s; the program ended without an exit, and this is what was "
                     "recorded before\n";
  std::string text = world.file + ": " + numberText(world.duration) + " s, Bullet in " +
                     world.precision + ", " + std::to_string(world.events.value_or(0)) +
                     " events, peak " + numberText(world.peak.value_or(0.0)) + " Pa";
  if (world.peak.value_or(0.0) > 0.0)
    text += " (" + numberText(lab::soundPressureLevel(*world.peak)) + " dB)";
  if (world.fullScale) text += "; 1.0 in the file is " + numberText(*world.fullScale) + " Pa";
  return text + "\n";
}

std::string nothingHeard(const std::string& program) {
  return program +
         " steps no Bullet world that could be heard: it links Bullet statically, or does not use "
         "it";
}

template <class Value>
nlohmann::ordered_json orNull(const std::optional<Value>& value) {
  return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json();
}

nlohmann::ordered_json jsonFor(const ListenedWorld& world) {
  nlohmann::ordered_json object;
  object["file"] = nullptr;
  if (!world.file.empty()) object["file"] = world.file;
  object["duration_s"] = world.duration;
  object["bullet_precision"] = world.precision;
  object["events"] = orNull(world.events);
  object["peak_pa"] = orNull(world.peak);
  object["full_scale_pa"] = orNull(world.fullScale);
  object["complete"] = world.isComplete;
  return object;
}

}  // namespace

ListenOutcome readOutcome(const std::filesystem::path& folder, const std::string& output) {
  ListenOutcome outcome;
  std::vector<int> numbers;
  std::ifstream report(folder / listen::kReportFile);
  for (std::string line; std::getline(report, line);)
    readLine(line, outcome, numbers);
  for (std::size_t index = 0; index < numbers.size(); ++index) {
    ListenedWorld& world = outcome.worlds[index];
    world.file = listen::fileOfWorld(output, numbers[index]).string();
    if (!world.isComplete) keepPart(world);
    lookAtFile(world);
  }
  return outcome;
}

std::string outcomeText(const ListenOutcome& outcome, const std::string& program) {
  std::string text;
  for (const std::string& message : outcome.messages)
    text += "carom: " + message + "\n";
  for (const ListenedWorld& world : outcome.worlds)
    text += "carom: " + lineFor(world);
  if (text.empty()) text = "carom: " + nothingHeard(program) + "\n";
  return text;
}

nlohmann::ordered_json outcomeJson(const ListenOutcome& outcome, const std::string& program) {
  nlohmann::ordered_json object =
      jsonFor(outcome.worlds.empty() ? ListenedWorld() : outcome.worlds.front());
  if (outcome.worlds.empty()) object["bullet_precision"] = nullptr;
  object["worlds"] = outcome.worlds.size();
  object["exit_code"] = outcome.exitCode;
  object["recordings"] = nlohmann::ordered_json::array();
  for (const ListenedWorld& world : outcome.worlds)
    object["recordings"].push_back(jsonFor(world));
  object["messages"] = outcome.messages;
  if (outcome.worlds.empty() && outcome.messages.empty())
    object["messages"].push_back(nothingHeard(program));
  return object;
}

}  // namespace carom::command
