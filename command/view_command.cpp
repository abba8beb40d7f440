#include "command/view_command.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <sstream>
#include <utility>

#include "command/command_line.h"
#include "command/library/scene_library.h"
#include "command/output/kept_inputs.h"
#include "command/output/output_target.h"
#include "command/progress_bar.h"
#include "lab/view/view_page.h"
#include "lab/view/view_run.h"
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <spawn.h>
#include <unistd.h>

#include "audio/io/partial_file.h"
#include "audio/propagation/sofa_file.h"
#include "scenes/format/scene_loader.h"
#include "scenes/limits/run_guard.h"
#include "scenes/recording/recorded_run.h"
#include "scenes/recording/recorded_scene.h"

namespace carom::command {

namespace fs = std::filesystem;
using namespace scenes;
using namespace lab;

namespace {

constexpr double kShortestView = 1e-3;   // s
constexpr double kLongestView = 3600.0;  // s

/// A run that the page is to show.
struct Wanted {
  std::string file;
  std::string id;
  std::string label;
  std::optional<StepperType> stepper = {};  // in place of the scene's own
  double step = 0.0;                        // s; 0: the scene's own
  double seconds = 0.0;                     // s; 0: all of it
  bool asTold = false;
  WrittenFile output = {};  // the page
};

/// Returns the name by which a page's address may choose a run: its file's, or a number.
std::string idOf(const std::string& file, std::size_t index) {
  const std::string stem = fs::path(file).stem().string();
  const bool isPlain = !stem.empty() && std::ranges::all_of(stem, [](char letter) {
    return (letter >= 'a' && letter <= 'z') || (letter >= '0' && letter <= '9') || letter == '_';
  });
  return isPlain ? stem : "run" + std::to_string(index + 1);
}

/// Shows the page in a browser, where there is a display; nothing comes of it otherwise.
void open(const std::string& file) {
  const auto isSet = [](const char* name) {
    return std::getenv(name) != nullptr;  // NOLINT(concurrency-mt-unsafe): there is one thread
  };
  if (isatty(STDOUT_FILENO) == 0 || !(isSet("DISPLAY") || isSet("WAYLAND_DISPLAY"))) return;
  std::string program = "xdg-open";
  std::string argument = file;
  std::array<char*, 3> words = {program.data(), argument.data(), nullptr};
  pid_t child = 0;
  (void)posix_spawnp(&child, program.c_str(), nullptr, nullptr, words.data(), environ);
}

ViewOptions optionsWith(ProgressBar& bar) {
  ViewOptions options;
  options.progress = [&bar](double share) { bar.show(share); };
  options.analysis = [&bar](std::string_view stage, double share) {
    bar.show(share, std::string(stage));
    return true;
  };
  return options;
}

/// Runs a scene that the page is to show.
MadeView runWanted(const Wanted& wanted, bool isConfined, const RunLimits& limits) {
  const Result<std::string> text = readSceneText(wanted.file);
  if (!text) return NoView{fail(kBadInput, text.error().message)};
  Result<Scene> scene = parseScene(*text, wanted.file, {.confined = isConfined});
  if (!scene) return NoView{fail(kBadInput, scene.error().message)};
  if (const Status kept = checkKept({wanted.output}, scene->files); !kept)
    return NoView{fail(kBadInput, kept.error().message)};
  if (wanted.stepper) scene->stepper.type = *wanted.stepper;
  if (wanted.step > 0.0) scene->stepper.step = wanted.step;
  if (wanted.seconds > 0.0) scene->duration = std::min(scene->duration, wanted.seconds);
  ViewOptions options;
  if (wanted.asTold) {
    hearAsTold(*scene);
    options.heardAt = [step = scene->stepper.step](const ImpulseEvent& event) {
      return endOfStep(event, step);
    };
  }
  MadeView made = runView(wanted.file, *scene, limits, std::move(options));
  if (auto* const view = std::get_if<ViewRun>(&made)) setSceneText(*view, *text, wanted.file);
  return made;
}

/// Returns the run, or the exit code of what was said about it.
MadeView make(const Wanted& wanted, bool isConfined, const RunLimits& limits) {
  MadeView made = isRunFile(wanted.file) || isRecording(wanted.file)
                      ? readView(wanted.file, isConfined, limits)
                      : runWanted(wanted, isConfined, limits);
  if (auto* const view = std::get_if<ViewRun>(&made)) {
    if (const Status kept = checkKept({wanted.output}, view->scene.files); !kept)
      return NoView{fail(kBadInput, kept.error().message)};
    view->id = wanted.id;
    view->label = wanted.label;
  }
  return made;
}

}  // namespace

std::vector<fs::path> pageFolders() {
  std::error_code ignored;
  const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
  std::vector<fs::path> folders;
  std::istringstream names(CAROM_VIEW_FOLDERS);
  for (std::string name; std::getline(names, name, ':');)
    folders.push_back((program.parent_path() / name).lexically_normal());
  return folders;
}

Status addDefaultHead(lab::ViewPage& page) {
  const auto head = audio::readSofaFile(audio::defaultSofaFile());
  return head ? page.setHead(*head) : Status(std::monostate{});
}

MadeView readView(const std::string& file, bool isConfined, const RunLimits& limits) {
  ProgressBar bar("reading " + file);
  ResourceWatch watch(limits);
  std::string limit;
  ViewOptions options = optionsWith(bar);
  options.analysis = [&](std::string_view stage, double share) {
    bar.show(share, std::string(stage));
    limit = watch.exceeded();
    return limit.empty();
  };
  Result<ViewRun> view = viewRecorded(file, isConfined, options);
  bar.clear();
  if (!limit.empty()) return NoView{endedEarly(file, watch, limit)};
  if (!view) return NoView{fail(kBadInput, view.error().message)};
  return *std::move(view);
}

MadeView runView(const std::string& file, const Scene& scene, const RunLimits& limits,
                 ViewOptions options) {
  if (const Status valid = validateRun(scene); !valid)
    return NoView{fail(kBadInput, file + ": " + valid.error().message)};
  ProgressBar bar("running " + scene.name);
  RunGuard guard(scene, limits);
  const ViewOptions shown = optionsWith(bar);
  options.progress = shown.progress;
  options.analysis = shown.analysis;
  options.guard = &guard;
  Result<ViewRun> view = viewScene(scene, options);
  bar.clear();
  if (guard.ended()) return NoView{endedEarly(file, *guard.ended(), "")};
  if (!view) return NoView{fail(kFailed, view.error().message)};
  return *std::move(view);
}

ViewCommand::ViewCommand(CLI::App& app)
    : command_(app.add_subcommand(
          "view",
          "Write a page in which scenes and recorded runs are seen and heard\n"
          "One file without a network: a browser shows it, and sounds it live (docs/view.md).")) {
  command_
      ->add_option("FILE", inputs_,
                   "scenes, or files of 'carom record' and of hosts; with several, the page "
                   "switches between them")
      ->required()
      ->type_name("SCENE|FILE.carom")
      ->transform(sceneName());
  command_
      ->add_option("-o,--output", output_,
                   "page to write; '-' is standard output; default: FILE's name with .html")
      ->type_name("FILE.html")
      ->check(fileName());
  command_->add_option("--label", labels_, "name of a run in the page, one for each FILE in turn")
      ->type_name("TEXT")
      ->allow_extra_args(false);
  command_->add_flag("--compare", compare_,
                     "show a scene twice: exact, and as Bullet tells it to its host");
  command_->add_option("--stepper", stepper_, "mechanics of scenes; default: their own choice")
      ->check(oneOf({"native", "bullet"}));
  command_->add_option("--step", step_, "Bullet's step; default: the scene's own")
      ->check(numberRange(kShortestStep, kLongestStep, "seconds"));
  command_->add_option("--seconds", seconds_, "only the beginning of scenes; default: all")
      ->check(numberRange(kShortestView, kLongestView, "seconds"));
  command_
      ->add_option("--template", template_,
                   "page without runs, as 'cmake --preset web' makes it; default: the one that "
                   "was built or installed with this program")
      ->type_name("FILE.html");
  command_->add_flag("--no-open", noOpen_, "do not open the page in a browser");
  addConfine(*command_, confine_);
  command_->add_flag("--json", json_, "print one JSON object instead of text");
  addLimits(*command_, run_);
  command_->footer(
      "Examples:\n"
      "  carom view marbles_in_a_box -o marbles.html\n"
      "  carom view billiard_break --compare\n"
      "  carom view scenes/library/*.json --seconds 2 -o gallery.html\n"
      "  carom view quiet.carom loud.carom --label quiet --label loud -o both.html");
}

bool ViewCommand::parsed() const {
  return command_->parsed();
}

int ViewCommand::run() const {
  const std::string output =
      output_.empty() ? fs::path(inputs_.front()).filename().replace_extension(".html").string()
                      : output_;
  std::vector<fs::path> read(inputs_.begin(), inputs_.end());
  read.emplace_back(template_);
  if (const Status kept = checkKept({{"--output", output}}, read); !kept)
    return fail(kBadInput, kept.error().message);
  const Result<OutputTarget> target = OutputTarget::create(output, "--output");
  if (!target) return fail(kBadInput, target.error().message);
  if (const Status writable = audio::checkWritable(target->path()); !writable)
    return fail(kBadInput, "--output: " + output + " " + writable.error().message);
  if (labels_.size() > inputs_.size())
    return fail(kBadInput, "--label: there are more labels than files");
  if (compare_ && inputs_.size() != 1)
    return fail(kBadInput, "--compare: expected one scene; several files are compared as they are");
  const auto pageTemplate = findTemplate(template_, pageFolders());
  if (!pageTemplate) return fail(kFailed, pageTemplate.error().message);
  if (const Status kept = checkKept({{"--output", output}}, {*pageTemplate}); !kept)
    return fail(kBadInput, kept.error().message);
  RunLimits limits = run_.limits();
  capMemory(limits.memory);
  const ResourceWatch watch(limits);

  std::vector<Wanted> wanted;
  for (std::size_t index = 0; index < inputs_.size(); ++index) {
    Wanted& one = wanted.emplace_back();
    one.file = inputs_[index];
    one.id = idOf(inputs_[index], index);
    one.label = index < labels_.size() ? labels_[index] : fs::path(one.file).stem().string();
    if (stepper_ == "native") one.stepper = StepperType::native;
    if (stepper_ == "bullet") one.stepper = StepperType::bullet;
    one.step = step_;
    one.seconds = seconds_;
  }
  for (Wanted& one : wanted)
    one.output = {"--output", output};
  for (Wanted& one : wanted)  // two of one name
    if (std::ranges::count(wanted, one.id, &Wanted::id) > 1)
      one.id += "-" + std::to_string(1 + (&one - wanted.data()));
  if (compare_) {
    if (isRunFile(inputs_.front()) || isRecording(inputs_.front()))
      return fail(kBadInput, "--compare: " + inputs_.front() +
                                 " is a recorded run; expected a scene, which can be run twice");
    Wanted& exact = wanted.front();
    exact.id = exact.label = "exact";
    exact.step = 0.0;
    wanted.push_back({.file = inputs_.front(),
                      .id = "as_told",
                      .label = "as Bullet tells it",
                      .stepper = StepperType::bullet,
                      .step = step_,
                      .seconds = seconds_,
                      .asTold = true});
  }

  Result<ViewPage> page =
      ViewPage::create(*pageTemplate, fs::path(inputs_.front()).stem().string());
  if (!page) return fail(kFailed, page.error().message);
  if (const Status head = addDefaultHead(*page); !head) return fail(kFailed, head.error().message);
  for (const Wanted& one : wanted) {
    limits.spent = watch.seconds();
    const MadeView made = make(one, confine_, limits);
    if (const auto* none = std::get_if<NoView>(&made)) return none->code;
    const Result<bool> added = page->add(std::get<ViewRun>(made));
    if (!added) return fail(kFailed, added.error().message);
  }
  const auto report = page->write(target->path());
  if (!report) return fail(kFailed, report.error().message);
  if (const Status sent = target->finish(); !sent) return fail(kFailed, sent.error().message);
  if (!noOpen_ && !json_ && !target->isStandardOutput()) open(output);
  if (json_) {
    nlohmann::ordered_json object;
    object["file"] = target->shown();
    object["bytes"] = report->bytes;
    object["scenes"] = page->runs();
    object["live"] = report->isLive;
    return answer(jsonText(object));
  }
  std::ostringstream text;
  text << target->shown() << ": " << page->runs() << (page->runs() == 1 ? " run, " : " runs, ")
       << report->bytes / 1000 << " kB" << (report->isLive ? "" : ", without sound")
       << (target->isStandardOutput() ? "\n" : "; open it in a browser\n");
  return answer(text.str());
}

}  // namespace carom::command
