#include "command/jello_command.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <sstream>
#include <string_view>
#include <vector>

#include "command/command_line.h"
#include "command/library/scene_library.h"
#include "command/output/kept_inputs.h"
#include "command/output/output_target.h"
#include "command/progress_bar.h"
#include "command/terminal/terminal.h"
#include "lab/estimate/run_estimate.h"
#include "lab/report/report_text.h"
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "audio/io/byte_file.h"
#include "audio/io/partial_file.h"
#include "native/jello/jello_file.h"
#include "scenes/format/model_file.h"
#include "scenes/format/scene_loader.h"
#include "scenes/run/jello_modes.h"
#include "scenes/run/jello_run.h"
#include "scenes/run/render.h"

namespace carom::command {

using namespace scenes;

using namespace audio;
using namespace native;

namespace {

std::vector<std::string> integratorNames() {
  std::vector<std::string> names;
  for (std::size_t which = 0; which < kJelloIntegrators; ++which)
    names.emplace_back(nameOf(static_cast<JelloIntegrator>(which)));
  return names;
}

constexpr double kSeconds = 5.0;      // s, duration for a world file, which has none
const Vec3 kListener(0.0, 0.0, 4.0);  // m, for a world file, which has no listener
constexpr const char* kAuto = "auto";

nlohmann::ordered_json jsonOf(const JelloRun& run, const JelloReport& report) {
  const JelloChoice& choice = run.choice();
  nlohmann::ordered_json object;
  object["integrator"] = nameOf(choice.stepping.integrator);
  object["dt_s"] = choice.stepping.step;
  if (std::isinf(run.limit()))
    object["dt_limit_s"] = nullptr;  // there is none
  else
    object["dt_limit_s"] = run.limit();
  if (choice.error > 0.0) object["expected_error_m"] = choice.error;
  object["first_contact_s"] = nullptr;  // of a jello that is not followed, or meets nothing
  if (std::isfinite(report.metAt)) object["first_contact_s"] = report.metAt;
  object["steps"] = report.steps;
  object["evaluations"] = report.evaluations;
  object["steps_per_s"] = report.stepsPerSecond;
  object["energy_start_J"] = report.start.total();
  object["energy_end_J"] = report.end.total();
  object["momentum"] = {report.momentum.x(), report.momentum.y(), report.momentum.z()};
  object["touches"] = report.touches;
  object["peak_pa"] = report.peak;
  object["stable"] = report.blowUp.empty();
  object["ended_early"] = lab::endedJson(report.endedEarly);
  return object;
}

std::string textOf(const JelloRun& run, const JelloReport& report) {
  const JelloStepping& stepping = run.choice().stepping;
  std::ostringstream text;
  text << nameOf(stepping.integrator) << ", " << report.steps << " steps of " << 1e3 * stepping.step
       << " ms (stable " << stableText(run.limit()) << "), " << report.stepsPerSecond
       << " a second\n";
  if (run.choice().error > 0.0) {
    text << "error expected " << run.choice().error << " m";
    if (std::isfinite(report.metAt))
      text << " up to the first contact, at " << report.metAt << " s";
    text << '\n';
  }
  text << "energy " << report.start.total() << " J at first, " << report.end.total()
       << " J at last; momentum " << report.momentum.norm() << " N s\n";
  if (report.touches > 0) text << report.touches << " touches of spheres\n";
  return text.str();
}

void warnOfError(const std::string& world, double wished, double expected) {
  std::ostringstream text;
  text << world << ": an error of " << wished << " m cannot be had; expected is " << expected
       << " m: a larger --error would cost less";
  warn(text.str());
}

/// Refuses a run whose sound would have no sample.
Status validateHeard(const Scene& scene) {
  if (scene.duration * scene.sampleRate >= 1.0) return std::monostate{};
  std::ostringstream text;
  text << "--seconds: " << scene.duration << " is less than a sample; expected at least "
       << 1.0 / scene.sampleRate << " s with --output";
  return Error{text.str()};
}

/// A scene begins with a brace, a world file with the name of an integrator.
bool isScene(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
  return first != std::string_view::npos && text[first] == '{';
}

}  // namespace

JelloCommand::JelloCommand(CLI::App& app)
    : command_(app.add_subcommand("jello",
                                  "Run a jello of springs, and hear it wobble\n"
                                  "Steps a lattice of points and springs, and writes its sound, "
                                  "its way, its energies or its "
                                  "modes.")) {
  std::vector<std::string> integrators = integratorNames();
  integrators.emplace_back(kAuto);
  command_
      ->add_option(
          "WORLD|SCENE", world_,
          "world file (.w) of the classic assignment, or a scene with a jello: a file, or a "
          "scene of the library by its name")
      ->required()
      ->type_name("SCENE|FILE")
      ->transform(sceneName());
  CLI::Option* integrator =
      command_
          ->add_option("--integrator", integrator_, "how it is stepped; default: as the file says")
          ->check(oneOf(integrators));
  CLI::Option* step = command_->add_option("--dt", step_, "the step; default: as the file says")
                          ->check(numberRange(1e-8, 1.0, "seconds"));
  command_
      ->add_option("--error", error_,
                   "of places: the largest step for it is found, and with "
                   "--integrator auto the cheapest integrator")
      ->check(numberRange(1e-9, 1.0, "metres"))
      ->excludes(step)
      ->needs(integrator);
  command_->add_option("--seconds", seconds_, "how long; default: 5, or as the scene says")
      ->check(numberRange(1e-6, 3600.0, "seconds"));
  command_->option_defaults()->group(kOutput);
  command_->add_option("-o,--output", output_, "WAV file to write; '-' is standard output")
      ->type_name("FILE.wav")
      ->check(fileName());
  command_->add_option("--trajectory", trajectory_, "file of its points to write (docs/jello.md)")
      ->check(fileName());
  command_->add_option("--energy", energy_, "CSV file of its energies to write")
      ->type_name("FILE.csv")
      ->check(fileName());
  command_
      ->add_option("--modes", modes_,
                   "modal model of it at rest to write, for carom strike and \"modes\" in scenes")
      ->check(fileName());
  command_
      ->add_option("--listener", listener_,
                   "a microphone; default: 0,0,4, or the scene's listeners")
      ->check(positionRange());
  command_
      ->add_option("--sample-rate", sampleRate_,
                   "samples in a second; default: 48000, or as the scene says")
      ->check(wholeNumberRange(8000, 192000, "Hz"));
  addScale(*command_, normalize_, fullScale_);
  addConfine(*command_, confine_);
  addLimits(*command_, run_);
  addKeepPartial(*command_, run_);
  command_->add_flag("--json", json_, "print one JSON object instead of text");
  command_->footer(
      "Examples:\n"
      "  carom jello scenes/library/jello/rotate.w --seconds 2 -o rotate.wav --normalize\n"
      "  carom jello my.w --integrator backward_euler --dt 0.01 --energy my.csv --json\n"
      "  carom jello jello_and_marbles --integrator auto --error 1e-5");
}

std::vector<WrittenFile> JelloCommand::written() const {
  return {{"--output", output_},
          {"--trajectory", trajectory_},
          {"--energy", energy_},
          {"--modes", modes_}};
}

/// Returns what is wrong with the names of the files to write; empty if nothing is.
Status JelloCommand::checkOutputs() const {
  for (const auto& [option, name] :
       {std::pair{"--trajectory", trajectory_}, {"--energy", energy_}, {"--modes", modes_}})
    if (Status valid = refuseStandardOutput(name, option, "expected the name of a file"); !valid)
      return valid;
  if (output_ == kStandardOutput && run_.keepPartial)
    return Error{"--keep-partial: standard output has no name; expected -o FILE.wav"};
  const std::vector<WrittenFile> outputs = written();
  if (Status kept = checkKept(outputs, {world_}); !kept) return kept;
  for (const auto& [option, file] : outputs)
    for (const auto& [otherOption, other] : outputs) {
      if (option == otherOption || file.empty() || other.empty()) continue;
      if (!isSameFile(file, other)) continue;
      std::ostringstream text;
      text << option << ": " << file.string() << " is that of " << otherOption
           << ", too; expected names that differ";
      return Error{text.str()};
    }
  if (!output_.empty() && !isWavName(output_))
    return Error{"--output: '" + output_ + "' is not the name of a WAV file; expected FILE.wav"};
  if (step_ > 0.0 && integrator_ == kAuto)
    return Error{"--dt: goes with an integrator; expected --integrator other than auto"};
  return std::monostate{};
}

void JelloCommand::applyStepping(JelloShape& jello) const {
  if (integrator_ == kAuto) {
    jello.integrator.reset();
    jello.step = 0.0;
  } else if (!integrator_.empty()) {
    const auto names = integratorNames();
    jello.integrator =
        static_cast<JelloIntegrator>(std::ranges::find(names, integrator_) - names.begin());
  }
  if (error_ > 0.0) {
    jello.error = error_;
    jello.step = 0.0;
  }
  if (step_ > 0.0) jello.step = step_;
}

/// Reads the world or scene, and applies what the command line asks for.
Result<Scene> JelloCommand::readScene() const {
  const Result<std::vector<std::byte>> bytes = readBytes(world_);
  if (!bytes) return Error{world_ + ": " + bytes.error().message};
  const std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  Scene scene;
  if (isScene(text)) {
    Result<Scene> read = parseScene(text, world_, {.confined = confine_});
    if (!read) return read;
    scene = *std::move(read);
  } else {
    const Result<JelloFile> file = jelloFromText(text, world_);
    if (!file) return file.error();
    scene = sceneOf(*file, kSeconds, kListener);
  }
  if (seconds_ > 0.0) scene.duration = seconds_;
  if (sampleRate_ > 0.0) scene.sampleRate = sampleRate_;
  if (const Status valid = validateHeard(scene); !output_.empty() && !valid) return valid.error();
  if (const auto place = threeNumbers(listener_, kFarthestListener)) {
    scene.listeners.assign(1, {.name = "listener", .position = *place});
    scene.paths.clear();
    scene.headFiles.clear();
  }
  for (SceneBody& body : scene.bodies) {
    auto* jello = std::get_if<std::shared_ptr<const JelloShape>>(&body.shape);
    if (jello == nullptr) continue;
    JelloShape changed = **jello;
    applyStepping(changed);
    if (step_ > 0.0 && !changed.integrator)
      return Error{world_ + ": --dt goes with an integrator; expected --integrator with it"};
    *jello = std::make_shared<const JelloShape>(std::move(changed));
    return scene;
  }
  return Error{world_ + ": has no jello; expected a body of type \"jello\""};
}

/// Writes the modal model of the lattice alone, without what is around it.
int JelloCommand::writeModes(const Scene& scene, ResourceWatch& watch) const {
  std::string limit;
  ProgressBar bar("modes of jello");
  const Result<ModalModel> model = jelloModalModel(
      jelloOf(scene)->lattice, {.medium = scene.medium, .radiation = RadiationSettings{}},
      [&](std::string_view, double share) {
        bar.show(share);
        limit = watch.exceeded();
        return limit.empty();
      });
  bar.clear();
  if (!limit.empty()) return endedEarly(world_, watch, limit);
  if (!model) return fail(kFailed, world_ + ": " + model.error().message);
  if (const Status written = writeModel(modes_, *model); !written)
    return fail(kFailed, written.error().message);
  return kDone;
}

bool JelloCommand::parsed() const {
  return command_->parsed();
}

/// Returns what the command line asks for; `guard` and `bar` are borrowed, `sound` is where the
/// sound goes if that is standard output, and `names` are those of files until the run is complete.
JelloOptions JelloCommand::optionsFor(RunGuard& guard, ProgressBar& bar, const std::string& sound,
                                      IncompleteNames& names) const {
  const auto outputOf = [&names](const std::string& name) {
    return name.empty() ? std::nullopt : std::optional(names.of(name));
  };
  JelloOptions options;
  options.guard = &guard;
  options.keepPartial = run_.keepPartial;
  options.soundFile = output_ == kStandardOutput ? std::filesystem::path(sound) : outputOf(output_);
  options.sound.normalize = normalize_;
  options.sound.fullScalePressure = fullScalePressure(fullScale_).value_or(kFullScalePressure);
  options.trajectoryFile = outputOf(trajectory_);
  options.energyFile = outputOf(energy_);
  options.progress = [&bar](double share) { bar.show(share); };
  return options;
}

int JelloCommand::run() const {
  if (const Status valid = checkOutputs(); !valid) return fail(kBadInput, valid.error().message);
  for (const std::string* name : {&output_, &trajectory_, &energy_, &modes_}) {
    if (name->empty() || *name == kStandardOutput) continue;
    if (const Status valid = checkWritable(*name); !valid)
      return fail(kFailed, *name + ": " + valid.error().message);
  }
  const Result<OutputTarget> target = OutputTarget::create(output_, "--output");
  if (!target) return fail(kBadInput, target.error().message);
  const Result<Scene> scene = readScene();
  if (!scene) return fail(kBadInput, scene.error().message);
  if (const Status kept = checkKept(written(), scene->files); !kept)
    return fail(kBadInput, kept.error().message);
  RunLimits limits = run_.limits();
  capMemory(limits.memory);
  ResourceWatch watch(limits);
  if (!modes_.empty())
    if (const int code = writeModes(*scene, watch); code != kDone) return code;
  limits.spent = watch.seconds();
  return runScene(*scene, *target, limits);
}

int JelloCommand::runScene(const Scene& scene, const OutputTarget& target,
                           const RunLimits& limits) const {
  ProgressBar bar("jello " + std::filesystem::path(world_).filename().string());
  RunGuard guard(scene, limits);
  if (const std::string why = lab::longRunWarning(lab::estimateRun(scene)); !why.empty())
    warn(world_ + ": " + why);
  IncompleteNames names(run_.keepPartial);
  Result<JelloRun> run = JelloRun::create(scene, optionsFor(guard, bar, target.path(), names));
  if (guard.ended()) return endedEarly(world_, *guard.ended(), "");
  if (!run) return fail(kBadInput, world_ + ": " + run.error().message);
  if (const std::string why = instabilityWarning(run->choice().stepping, run->limit());
      !why.empty())
    warn(world_ + ": " + why + "; --dt and --integrator take others");
  const double wished = jelloOf(scene)->error;
  if (run->choice().error > 1.01 * wished) warnOfError(world_, wished, run->choice().error);
  const Result<JelloReport> report = run->run();
  bar.clear();
  if (!report) return fail(kFailed, report.error().message);
  if (report->endedEarly) {
    if (json_) answer(jsonText(jsonOf(*run, *report)));
    return endedEarly(world_, *report->endedEarly,
                      run_.keepPartial ? "the files called .incomplete" : "");
  }
  if (const Status named = names.complete(); !named) return fail(kFailed, named.error().message);
  if (const Status sent = target.finish(); !sent) return fail(kFailed, sent.error().message);
  const int answered = answer(json_ ? jsonText(jsonOf(*run, *report)) : textOf(*run, *report));
  if (!report->blowUp.empty())
    return fail(kFailed, world_ + ": " + report->blowUp + "; what came before is written");
  return answered;
}

}  // namespace carom::command
