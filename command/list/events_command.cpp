#include "command/list/events_command.h"

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <new>
#include <span>
#include <sstream>
#include <variant>

#include "command/command_line.h"
#include "command/library/scene_library.h"
#include "command/progress_bar.h"
#include "lab/report/report_text.h"
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "audio/io/byte_file.h"
#include "scenes/format/scene_loader.h"
#include "scenes/recording/recorded_run.h"
#include "scenes/recording/recorded_scene.h"
#include "scenes/rows/events_file.h"
#include "scenes/run/render.h"

namespace carom::command {

using namespace scenes;

namespace {

constexpr std::size_t kWidestNames = 36;  // letters

/// Keeps the rows of events, and no sound.
class EventRowSink : public RenderSink {
 public:
  explicit EventRowSink(const Scene& scene) : scene_(scene), text_(EventRows::header()) {}

  Status write(std::span<const float* const>, std::size_t) override { return std::monostate{}; }
  void add(const ImpulseEvent& event, const EventSound& sound) override {
    text_ += rows_.row(event, scene_, sound);
  }
  const std::string& text() const { return text_; }

 private:
  const Scene& scene_;
  EventRows rows_;
  std::string text_;
};

/// The rows of a run, or the exit code of what was said about it.
using MadeRows = std::variant<std::string, int>;

/// Runs a scene, or plays its recorded run, for its events.
MadeRows rowsOf(const std::string& file, const Scene& scene, const Replay& replay,
                const RunLimits& limits) {
  ProgressBar bar("events of " + scene.name);
  capMemory(limits.memory);
  RunGuard guard(scene, limits);
  RenderOptions options;
  options.replay = replay;
  options.guard = &guard;
  options.progress = [&bar](double share) { bar.show(share); };
  options.analysis = [&bar](std::string_view stage, double share) {
    bar.show(share, std::string(stage));
    return true;
  };
  EventRowSink sink(scene);
  const Result<RenderReport> report = renderScene(scene, options, sink);
  bar.clear();
  if (guard.ended()) return endedEarly(file, *guard.ended(), "");
  if (!report) return fail(kFailed, report.error().message);
  return sink.text();
}

MadeRows rowsOfRun(const std::string& file, bool isConfined, const RunLimits& limits) {
  if (isRunFile(file)) {
    Result<RecordedRun> run = openRun(file, isConfined);
    if (!run) return fail(kBadInput, run.error().message);
    return rowsOf(
        file, run->scene, [&run](double) { return runStepper(run->reader); }, limits);
  }
  const Result<RecordedScene> recorded = loadRecordedScene(file, isConfined);
  if (!recorded) return fail(kBadInput, recorded.error().message);
  return rowsOf(file, recorded->scene, replayOf(recorded->recording, recorded->scene), limits);
}

MadeRows rowsOfScene(const std::string& file, bool isConfined, const RunLimits& limits) {
  const Result<Scene> scene = loadScene(file, {.confined = isConfined});
  if (!scene) return fail(kBadInput, scene.error().message);
  if (const Status valid = validateRun(*scene); !valid)
    return fail(kBadInput, file + ": " + valid.error().message);
  return rowsOf(file, *scene, {}, limits);
}

MadeRows rowsOfFile(const std::string& file) {
  const Result<std::vector<std::byte>> bytes = audio::readBytes(file);
  if (!bytes) return fail(kBadInput, file + ": " + bytes.error().message);
  return std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size());
}

nlohmann::ordered_json jsonOf(const ListedCollision& collision) {
  nlohmann::ordered_json object;
  object["collision"] = collision.number;
  object["time_s"] = collision.time;
  object["body"] = collision.body;
  object["other"] = collision.other;
  object["impulse_Ns"] = collision.impulse;
  object["approach_speed_m_s"] = collision.approachSpeed;
  object["position_m"] = {collision.position.x(), collision.position.y(), collision.position.z()};
  object["peak_pa"] = collision.peak;
  object["level_db"] = nullptr;
  if (collision.peak > 0.0) object["level_db"] = lab::soundPressureLevel(collision.peak);
  object["heard"] = collision.isHeard;
  return object;
}

/// Returns the text with as many spaces as fill the width.
std::string padded(std::string text, std::size_t width) {
  if (text.size() < width) text.resize(width, ' ');
  return text;
}

std::string tableOf(const std::vector<ListedCollision>& collisions) {
  std::vector<std::string> names;
  std::size_t width = 6;
  for (const ListedCollision& collision : collisions) {
    names.push_back(collision.body + ", " + collision.other);
    width = std::max(width, std::min(names.back().size(), kWidestNames));
  }
  std::string text =
      "    time s  " + padded("bodies", width) + "  impulse N s  speed m/s  peak Pa  dB SPL\n";
  for (std::size_t row = 0; row < collisions.size(); ++row) {
    const ListedCollision& collision = collisions[row];
    std::array<char, 96> numbers{};
    std::snprintf(numbers.data(), numbers.size(), "%10.6f", collision.time);
    text += std::string(numbers.data()) + "  " + padded(names[row], width);
    std::snprintf(numbers.data(), numbers.size(), "  %11.4g  %9.4g  %7.4g  %6.1f",
                  collision.impulse, collision.approachSpeed, collision.peak,
                  collision.peak > 0.0 ? lab::soundPressureLevel(collision.peak) : 0.0);
    text += collision.isHeard ? numbers.data() : std::string(numbers.data()) + "  not heard";
    text += '\n';
  }
  return text;
}

}  // namespace

EventsCommand::EventsCommand(CLI::App& app)
    : command_(app.add_subcommand(
          "events",
          "List the collisions of a scene or a run, or the loudest of them\n"
          "Tells of each collision when it is, who hits whom, how hard, and how loud it may be at "
          "the loudest listener: the peak is an upper bound, that of 'carom render --events'.")) {
  command_
      ->add_option(
          "FILE", input_,
          "a scene, by its file or its name in the library; a file of 'carom record' or of a "
          "host's recordRun; or "
          "a CSV file of 'carom render --events'")
      ->required()
      ->type_name("SCENE|FILE")
      ->transform(sceneName());
  command_
      ->add_option("--loudest", loudest_,
                   "only so many, the loudest first; default: all, in order of time")
      ->check(wholeNumberRange(1, 1e9));
  addConfine(*command_, confine_);
  addLimits(*command_, run_);
  command_->add_flag("--json", json_, "print one JSON object instead of text");
  command_->footer(
      "Examples:\n"
      "  carom events marbles_in_a_box --loudest 5\n"
      "  carom events marbles.carom --loudest 1 --json\n"
      "  carom events ball.csv");
}

bool EventsCommand::parsed() const {
  return command_->parsed();
}

int EventsCommand::answerWith(const std::string& rows) const {
  const auto all = readCollisions(rows, input_);
  if (!all) return fail(kBadInput, all.error().message);
  const auto most = static_cast<std::size_t>(loudest_);
  const std::vector<ListedCollision> shown = most > 0 ? loudest(*all, most) : *all;
  if (json_) {
    nlohmann::ordered_json object;
    object["file"] = input_;
    object["collisions"] = all->size();
    object["listed"] = nlohmann::ordered_json::array();
    for (const ListedCollision& collision : shown)
      object["listed"].push_back(jsonOf(collision));
    return answer(jsonText(object));
  }
  std::string text = input_ + ": " + std::to_string(all->size()) +
                     (all->size() == 1 ? " collision" : " collisions");
  if (shown.size() < all->size()) text += ", the " + std::to_string(shown.size()) + " loudest";
  return answer(text + "; peaks of clicks are upper bounds, of rings estimates\n" +
                (shown.empty() ? "" : tableOf(shown)));
}

int EventsCommand::run() const {
  const RunLimits limits = run_.limits();
  const std::string extension =
      CLI::detail::to_lower(std::filesystem::path(input_).extension().string());
  const bool isRun = isRunFile(input_) || isRecording(input_);
  const MadeRows rows = extension == ".csv" ? rowsOfFile(input_)
                        : isRun             ? rowsOfRun(input_, confine_, limits)
                                            : rowsOfScene(input_, confine_, limits);
  if (const int* code = std::get_if<int>(&rows)) return *code;
  return answerWith(std::get<std::string>(rows));
}

}  // namespace carom::command
