// The carom command. Exit codes: 0 done, 1 failed, 2 bad input, 3 ended by a limit; by a signal:
// 129, 130, 131, 143, 152; without a reader: 141.

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <iostream>
#include <map>
#include <new>
#include <optional>
#include <sstream>
#include <string>
#include <variant>
#include <vector>

#include "command/batch_command.h"
#include "command/command_line.h"
#include "command/fit_command.h"
#include "command/help/command_help.h"
#include "command/help/help_text.h"
#include "command/help/usage_error.h"
#include "command/jello_command.h"
#include "command/library/scene_library.h"
#include "command/list/completion_command.h"
#include "command/list/events_command.h"
#include "command/list/help_command.h"
#include "command/list/materials_command.h"
#include "command/list/scenes_command.h"
#include "command/listen_command.h"
#include "command/modes_command.h"
#include "command/output/kept_inputs.h"
#include "command/output/output_target.h"
#include "command/output/sound_name.h"
#include "command/progress_bar.h"
#include "command/report_command.h"
#include "command/run_options.h"
#include "command/signals.h"
#include "command/stability_command.h"
#include "command/strike_command.h"
#include "command/terminal/terminal.h"
#include "command/video_command.h"
#include "command/view_command.h"
#include "command/warnings.h"
#include "lab/compare/compare.h"
#include "lab/estimate/run_estimate.h"
#include "lab/report/report_text.h"
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "audio/io/partial_file.h"
#include "carom/audio/synth.h"
#include "scenes/format/scene_loader.h"
#include "scenes/recording/recorded_run.h"
#include "scenes/recording/recorded_scene.h"
#include "scenes/run/bullet_only.h"
#include "scenes/run/jello_scene.h"
#include "scenes/run/native_only.h"
#include "scenes/run/plan.h"
#include "scenes/run/render.h"

namespace carom::command {

using namespace scenes;
using namespace lab;

using namespace audio;

namespace {

struct Arguments {
  std::string scene;  // for replay: the recording
  bool json = false;
  // render
  std::string output;
  std::string events;
  std::string format = "float32";
  bool normalize = false;
  bool limit = false;
  bool noLimit = false;
  std::string fullScale;  // empty: kFullScalePressure
  std::string stepper;
  double step = 0.0;  // 0: the scene's own
  std::string pulse;  // this and the next four are empty for the scene's own
  std::string sampling;
  std::string radiation;
  std::string ringing;
  std::string air;
  std::string recoil;
  // compare
  std::vector<double> steps;
  // replay
  std::vector<std::string> listeners;  // empty: the scene's
  SoundSpan span;
  RunOptions run;
  double tail = 10.0;  // s
  bool stems = false;
  bool confine = false;
};

void applyStepper(const Arguments& arguments, Scene& scene) {
  if (arguments.stepper == "native") scene.stepper.type = StepperType::native;
  if (arguments.stepper == "bullet") scene.stepper.type = StepperType::bullet;
  if (arguments.step > 0.0) scene.stepper.step = arguments.step;
}

constexpr const char* kDissipative = "dissipative";

// Returns the pulse shapes by the names that scene files have for them.
const std::map<std::string, PulseShape>& pulseShapes() {
  static const std::map<std::string, PulseShape> shapes = {
      {"hertz", PulseShape::hertz},
      {"half_sine", PulseShape::halfSine},
      {"gaussian", PulseShape::gaussian},
      {"mitchell_netravali", PulseShape::mitchellNetravali},
      {"course_gaussian", PulseShape::courseGaussian}};
  return shapes;
}

void applySound(const Arguments& arguments, Scene& scene) {
  SynthSettings& sound = scene.sound;
  if (!arguments.pulse.empty()) {
    sound.dissipative = arguments.pulse == kDissipative;
    sound.comparison.pulse =
        sound.dissipative ? PulseShape::hertz : pulseShapes().at(arguments.pulse);
  }
  if (arguments.sampling == "band_limited") sound.comparison.sampling = Sampling::bandLimited;
  if (arguments.sampling == "naive") sound.comparison.sampling = Sampling::naive;
  if (arguments.ringing == "coupled") sound.ringingContact = RingingContact::coupled;
  if (arguments.ringing == "pressed") sound.ringingContact = RingingContact::pressed;
  if (!arguments.air.empty()) sound.airAbsorption = arguments.air == "on";
  if (arguments.radiation == "exact") sound.comparison.radiation = Radiation::exact;
  if (arguments.radiation == "compact") sound.comparison.radiation = Radiation::compact;
  sound.stems = arguments.stems;
  if (arguments.recoil == "sphere") scene.recoil = RecoilModel::sphere;
  if (arguments.recoil == "shape") scene.recoil = RecoilModel::shape;
}

// Returns why the output files cannot be written, before anything is read; empty if they can.
Status checkOutputs(const Arguments& arguments) {
  if (const Status kept = checkKept(
          {{"--output", arguments.output}, {"--events", arguments.events}}, {arguments.scene});
      !kept)
    return kept.error();
  if (!isWavName(arguments.output))
    return Error{"--output: '" + arguments.output +
                 "' is not the name of a WAV file; expected FILE.wav"};
  if (!arguments.events.empty() && isSameFile(arguments.events, arguments.output))
    return Error{"--events: " + arguments.events + " is the sound file too; expected another name"};
  return std::monostate{};
}

// Refuses an output that would take the place of a file that the scene names, or, with stems, of
// the scene.
Status checkSceneKept(const Arguments& arguments, const Scene& scene) {
  std::vector<WrittenFile> outputs = {{"--output", arguments.output},
                                      {"--events", arguments.events}};
  if (arguments.stems)
    for (const Stem stem : {Stem::clicks, Stem::rings, Stem::contacts})
      outputs.push_back({"--stems", stemName(arguments.output, stem)});
  std::vector<std::filesystem::path> read = scene.files;
  read.emplace_back(arguments.scene);
  return checkKept(outputs, read);
}

RenderOptions renderOptions(const Arguments& arguments) {
  RenderOptions options;
  options.format = arguments.format == "pcm16" ? SampleFormat::pcm16 : SampleFormat::float32;
  options.normalize = arguments.normalize;
  if (arguments.limit || arguments.noLimit) options.limit = arguments.limit;
  options.fullScale = fullScalePressure(arguments.fullScale).value_or(kFullScalePressure);
  if (!arguments.events.empty()) options.eventsFile = arguments.events;
  return options;
}

Detail detail() {
  return talk().isVerbose() ? Detail::whole : Detail::brief;
}

nlohmann::ordered_json withWarnings(nlohmann::ordered_json object, const Warnings& warnings) {
  object["warnings"] = warnings.all();
  return object;
}

// Renders; an allocation that fails ends the run as the guard's limit of memory does.
Result<RenderReport> renderBounded(const Scene& scene, const RenderOptions& options) {
  try {
    return renderScene(scene, options);
  } catch (const std::bad_alloc&) {
    options.guard->runOut();
    return Error{scene.name + ": " + options.guard->ended()->what};
  }
}

void warnOfLongRun(const std::string& file, const Scene& scene, Warnings& warnings) {
  if (const std::string why = longRunWarning(estimateRun(scene)); !why.empty())
    warnings.add(file + ": " + why);
}

// Renders a scene to which the options of the command line have been applied already.
int renderInto(const Arguments& arguments, const OutputTarget& target, const Scene& scene,
               const Replay& replay) {
  Warnings warnings;
  if (const std::string why = instabilityWarning(scene); !why.empty())
    warnings.add(arguments.scene + ": " + why);
  warnings.add(sceneWarnings(scene));
  if (!replay) warnOfLongRun(arguments.scene, scene, warnings);
  ProgressBar bar("rendering " + scene.name);
  RenderOptions options = renderOptions(arguments);
  options.soundFile = target.path();
  options.replay = replay;
  options.span = arguments.span;
  capMemory(arguments.run.limits().memory);
  RunGuard guard(scene, arguments.run.limits());
  options.guard = &guard;
  options.keepPartial = arguments.run.keepPartial;
  // A part of a recording is as it is in the whole.
  if (arguments.span.to >= scene.duration) options.tail = arguments.tail;
  options.progress = [&](double share) { bar.show(share); };
  ProgressBar analysis("modes and recoils of " + scene.name);
  options.analysis = [&analysis](std::string_view, double share) {
    analysis.show(share);
    if (share >= 1.0) analysis.clear();
    return true;
  };
  Result<RenderReport> report = renderBounded(scene, options);
  bar.clear();
  if (!report && guard.ended()) return endedEarly(arguments.scene, *guard.ended(), "");
  if (!report) return fail(kFailed, report.error().message);
  if (target.isStandardOutput()) report->file = target.shown();
  warnings.add(renderWarnings(*report, options));
  if (report->endedEarly && !arguments.json)
    return endedEarly(arguments.scene, *report->endedEarly, report->file.string());
  if (!report->endedEarly)
    if (const Status sent = target.finish(); !sent) return fail(kFailed, sent.error().message);
  const int answered = answer(arguments.json ? jsonText(withWarnings(renderJson(*report), warnings))
                                             : renderText(*report, detail()));
  if (!report->endedEarly) return answered;
  return endedEarly(arguments.scene, *report->endedEarly, report->file.string());
}

// Settles where the sound goes; refuses what cannot be written there, before anything is read.
Result<OutputTarget> soundTarget(Arguments& arguments) {
  if (arguments.output.empty()) {
    const Result<std::string> name = soundNameOf(arguments.scene);
    if (!name) return name.error();
    arguments.output = *name;
  }
  if (const Status valid = checkOutputs(arguments); !valid) return valid.error();
  const bool isStream = arguments.output == kStandardOutput;
  if (isStream && arguments.stems)
    return Error{"--stems: several files cannot go to standard output; expected -o FILE.wav"};
  if (isStream && arguments.run.keepPartial)
    return Error{"--keep-partial: standard output has no name; expected -o FILE.wav"};
  if (const Status valid = refuseStandardOutput(arguments.events, "--events",
                                                "the sound goes by -o; expected FILE.csv");
      !valid)
    return valid.error();
  return OutputTarget::create(arguments.output, "--output");
}

int render(Arguments& arguments) {
  const Result<OutputTarget> target = soundTarget(arguments);
  if (!target) return fail(kBadInput, target.error().message);
  Result<Scene> scene = loadScene(arguments.scene, {.confined = arguments.confine});
  if (!scene) return fail(kBadInput, scene.error().message);
  applyStepper(arguments, *scene);
  applySound(arguments, *scene);
  if (arguments.step > 0.0 && scene->stepper.type == StepperType::native) {
    return fail(kBadInput,
                "--step: the native stepper has no step; expected --stepper bullet with it");
  }
  if (const Status valid = validateRun(*scene); !valid)
    return fail(kBadInput, arguments.scene + ": " + valid.error().message);
  if (const Status kept = checkSceneKept(arguments, *scene); !kept)
    return fail(kBadInput, kept.error().message);
  return renderInto(arguments, *target, *scene, {});
}

// Records the whole motion of spheres on the native stepper.
int recordMotion(const Arguments& arguments, const OutputTarget& target, const Scene& scene,
                 const std::string& text) {
  ProgressBar bar("recording " + scene.name);
  const auto start = std::chrono::steady_clock::now();
  RunGuard guard(scene, arguments.run.limits());
  const Result<Recording> recording = recordScene(
      scene, text, arguments.scene, [&](double share) { bar.show(share); }, &guard);
  bar.clear();
  if (guard.ended()) return endedEarly(arguments.scene, *guard.ended(), "");
  if (!recording) return fail(kBadInput, recording.error().message);
  const Result<std::uintmax_t> bytes = saveRecording(*recording, target.path());
  if (!bytes) return fail(kFailed, bytes.error().message);
  if (const Status sent = target.finish(); !sent) return fail(kFailed, sent.error().message);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  const RecordReport report{target.shown(), *bytes, took.count()};
  return answer(arguments.json ? jsonText(recordJson(*recording, report))
                               : recordText(*recording, report));
}

// Records what a stepper tells: Bullet, or a jello.
int recordStepper(const Arguments& arguments, const OutputTarget& target, const Scene& scene,
                  const std::string& text) {
  ProgressBar bar("recording " + scene.name);
  const auto start = std::chrono::steady_clock::now();
  RunGuard guard(scene, arguments.run.limits());
  const Result<RunReport> run = recordRun(
      {&scene, text, arguments.scene, target.path()}, [&](double share) { bar.show(share); },
      &guard);
  bar.clear();
  if (guard.ended()) return endedEarly(arguments.scene, *guard.ended(), "");
  if (!run) return fail(kFailed, run.error().message);
  if (const Status sent = target.finish(); !sent) return fail(kFailed, sent.error().message);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  const RunFileReport report{target.shown(), scene.duration, took.count(), *run};
  return answer(arguments.json ? jsonText(runJson(report)) : runText(report));
}

int record(const Arguments& arguments) {
  if (const Status kept = checkKept({{"--output", arguments.output}}, {arguments.scene}); !kept)
    return fail(kBadInput, kept.error().message);
  const Result<OutputTarget> target = OutputTarget::create(arguments.output, "--output");
  if (!target) return fail(kBadInput, target.error().message);
  Result<std::string> text = readSceneText(arguments.scene);
  if (!text) return fail(kBadInput, text.error().message);
  Result<Scene> scene = parseScene(*text, arguments.scene, {.confined = arguments.confine});
  if (!scene) return fail(kBadInput, scene.error().message);
  applyStepper(arguments, *scene);
  if (const Status valid = validateRun(*scene); !valid)
    return fail(kBadInput, arguments.scene + ": " + valid.error().message);
  if (const Status kept = checkSceneKept(arguments, *scene); !kept)
    return fail(kBadInput, kept.error().message);
  Warnings warnings;
  warnOfLongRun(arguments.scene, *scene, warnings);
  capMemory(arguments.run.limits().memory);
  // Spheres on the native stepper have motion between events that a formula knows.
  return validateForRecording(*scene) ? recordMotion(arguments, *target, *scene, *text)
                                      : recordStepper(arguments, *target, *scene, *text);
}

// Replaces the scene's listeners by microphones at the places given on the command line, if any.
void applyListeners(const Arguments& arguments, Scene& scene) {
  if (arguments.listeners.empty()) return;
  scene.listeners.clear();
  scene.paths.clear();
  scene.headFiles.clear();
  for (const std::string& text : arguments.listeners) {
    Listener& listener = scene.listeners.emplace_back();
    listener.name = "listener_" + std::to_string(scene.listeners.size());
    listener.position = threeNumbers(text, kFarthestListener).value();
  }
}

// Returns why the scene has no such span; empty if it has.
Status validateSpan(const SoundSpan& span, const Scene& scene) {
  std::ostringstream text;
  if ((scene.duration - span.from) * scene.sampleRate < 1.0) {
    text << "--from: " << span.from << " s; expected less than " << scene.duration
         << " s, where the recording ends";
  } else if ((std::min(span.to, scene.duration) - span.from) * scene.sampleRate < 1.0) {
    text << "--to: " << std::min(span.to, scene.duration)
         << " s; expected at least a sample more than --from, " << span.from << " s";
  }
  if (text.str().empty()) return std::monostate{};
  return Error{text.str()};
}

// Renders a run of a scene that was recorded.
int replayScene(const Arguments& arguments, const OutputTarget& target, Scene& scene,
                const Replay& replay) {
  if (const Status valid = validateSpan(arguments.span, scene); !valid)
    return fail(kBadInput, valid.error().message);
  if (const Status kept = checkSceneKept(arguments, scene); !kept)
    return fail(kBadInput, kept.error().message);
  applySound(arguments, scene);
  applyListeners(arguments, scene);
  return renderInto(arguments, target, scene, replay);
}

int replay(Arguments& arguments) {
  const Result<OutputTarget> target = soundTarget(arguments);
  if (!target) return fail(kBadInput, target.error().message);
  if (isRunFile(arguments.scene)) {
    Result<RecordedRun> run = openRun(arguments.scene, arguments.confine);
    if (!run) return fail(kBadInput, run.error().message);
    return replayScene(arguments, *target, run->scene,
                       [&run](double) { return runStepper(run->reader); });
  }
  Result<RecordedScene> recorded = loadRecordedScene(arguments.scene, arguments.confine);
  if (!recorded) return fail(kBadInput, recorded.error().message);
  return replayScene(arguments, *target, recorded->scene,
                     replayOf(recorded->recording, recorded->scene));
}

int infoOfRun(const Arguments& arguments) {
  const Result<RecordedRun> run = openRun(arguments.scene, arguments.confine);
  if (!run) return fail(kBadInput, run.error().message);
  Warnings warnings;
  warnings.add(sceneWarnings(run->scene));
  std::error_code ignored;
  const std::uintmax_t bytes = std::filesystem::file_size(arguments.scene, ignored);
  const RunHeader& header = run->reader->header();
  if (!arguments.json) {
    std::ostringstream text;
    text << arguments.scene << ": a run of " << header.duration << " s on the " << header.stepper
         << " stepper, " << bytes << " bytes\n";
    return answer(text.str() + infoText(run->scene, detail()));
  }
  nlohmann::ordered_json object = withWarnings(infoJson(run->scene), warnings);
  object["recording"] = {{"file", arguments.scene},
                         {"bytes", bytes},
                         {"duration_s", header.duration},
                         {"stepper", header.stepper}};
  return answer(jsonText(object));
}

int infoOfRecording(const Arguments& arguments) {
  const Result<RecordedScene> recorded = loadRecordedScene(arguments.scene, arguments.confine);
  if (!recorded) return fail(kBadInput, recorded.error().message);
  const RecordReport report{arguments.scene, recorded->bytes};
  Warnings warnings;
  warnings.add(sceneWarnings(recorded->scene));
  if (!arguments.json)
    return answer(recordText(recorded->recording, report) + infoText(recorded->scene, detail()));
  nlohmann::ordered_json object = withWarnings(infoJson(recorded->scene), warnings);
  object["recording"] = recordJson(recorded->recording, report);
  return answer(jsonText(object));
}

int info(const Arguments& arguments) {
  if (isRunFile(arguments.scene)) return infoOfRun(arguments);
  if (isRecording(arguments.scene)) return infoOfRecording(arguments);
  const Result<Scene> scene = loadScene(arguments.scene, {.confined = arguments.confine});
  if (!scene) return fail(kBadInput, scene.error().message);
  Warnings warnings;
  warnings.add(sceneWarnings(*scene));
  const RunEstimate estimate = estimateRun(*scene);
  if (!arguments.json) return answer(infoText(*scene, detail()) + estimateText(estimate));
  nlohmann::ordered_json object = infoJson(*scene);
  object["estimate"] = estimateJson(estimate);
  return answer(jsonText(withWarnings(object, warnings)));
}

int compare(const Arguments& arguments) {
  const Result<Scene> scene = loadScene(arguments.scene, {.confined = arguments.confine});
  if (!scene) return fail(kBadInput, scene.error().message);
  std::vector<double> steps = arguments.steps;
  if (steps.empty()) steps = {1.0 / 60.0, 1.0 / 240.0, 1.0 / 1000.0};
  for (const Status& valid : {validateForBullet(*scene), validateForNative(*scene)}) {
    if (!valid) return fail(kBadInput, arguments.scene + ": " + valid.error().message);
  }
  ProgressBar bar("comparing " + scene->name);
  capMemory(arguments.run.limits().memory);
  RunGuard guard(*scene, arguments.run.limits());
  const Result<CompareReport> report = compareScene(
      *scene, steps, {.progress = [&](double share) { bar.show(share); }, .guard = &guard});
  bar.clear();
  if (guard.ended()) return endedEarly(arguments.scene, *guard.ended(), "");
  if (!report) return fail(kFailed, report.error().message);
  return answer(arguments.json ? jsonText(compareJson(*scene, *report))
                               : compareText(*scene, *report));
}

// Accepts a step that Bullet can take; the range is that of
// scene files. (CLI::Range lets NaN pass.)
CLI::Validator stepRange() {
  const auto check = [](const std::string& text) -> std::string {
    double step = 0.0;
    if (CLI::detail::lexical_cast(text, step) && step >= kShortestStep && step <= kLongestStep) {
      return {};
    }
    return text + " is not a step; expected a number from 1e-5 to 0.1 (seconds)";
  };
  return {check, "SECONDS", "a number of seconds from 1e-5 to 0.1"};
}

CLI::Validator onePulse() {
  std::vector<std::string> words = {kDissipative};
  for (const auto& [name, shape] : pulseShapes())
    words.push_back(name);
  return oneOf(words);
}

void addScene(CLI::App& command, Arguments& arguments) {
  command
      .add_option("SCENE", arguments.scene,
                  "a file (JSON, docs/scenes.md), or a scene of the library by its name")
      ->required()
      ->transform(sceneName());
  command.add_flag("--json", arguments.json, "print one JSON object instead of text");
  addConfine(command, arguments.confine);
}

// Adds the options that say where a sound ends, and its run.
void addEnd(CLI::App& command, Arguments& arguments) {
  command
      .add_option("--tail", arguments.tail,
                  "for how long the sound may go on after the scene, until it is 60 dB below its "
                  "peak; what is louder then fades over 50 ms")
      ->check(numberRange(0, 60, "seconds"))
      ->capture_default_str();
  addLimits(command, arguments.run);
  addKeepPartial(command, arguments.run);
}

// Adds the options of the sound itself, in place of what the scene says of it.
void addChoices(CLI::App& command, Arguments& arguments) {
  command
      .add_option("--pulse", arguments.pulse,
                  "force of a contact over time; default: the scene's choice")
      ->check(onePulse());
  command
      .add_option("--sampling", arguments.sampling,
                  "how pulses become samples; default: the scene's choice")
      ->check(oneOf({"band_limited", "naive"}));
  command
      .add_option("--radiation", arguments.radiation,
                  "of a rigid sphere, or of one that is small; default: the scene's choice")
      ->check(oneOf({"exact", "compact"}));
  command
      .add_option(
          "--ringing", arguments.ringing,
          "whether modes give way in a contact (coupled) or not; default: the scene's choice")
      ->check(oneOf({"coupled", "pressed"}));
  command
      .add_option("--air", arguments.air,
                  "whether the air absorbs sound on its way; default: the scene's choice")
      ->check(oneOf({"on", "off"}));
  command
      .add_option("--recoil", arguments.recoil,
                  "of bodies that are no spheres: by their shape, or as a sphere of equal dipole; "
                  "default: the scene's choice")
      ->check(oneOf({"shape", "sphere"}));
}

// Adds the options of a WAV file, which are the same for a scene and a recording; `input` is the
// word for them.
void addSound(CLI::App& command, Arguments& arguments, const std::string& input) {
  command.option_defaults()->group(kOutput);
  command
      .add_option("-o,--output", arguments.output,
                  "WAV file to write, in place of one that is there; '-' is standard output; "
                  "default: " +
                      input + ".wav in the current folder, but only in place of a sound of Carom's")
      ->type_name("FILE.wav")
      ->check(fileName());
  command.add_option("--format", arguments.format, "sample format")
      ->check(oneOf({"float32", "pcm16"}))
      ->capture_default_str();
  CLI::Option* normalize = addScale(command, arguments.normalize, arguments.fullScale);
  CLI::Option* limit =
      command
          .add_flag("--limit", arguments.limit,
                    "turn down what exceeds full scale; the default with --format pcm16")
          ->excludes(normalize);
  command
      .add_flag("--no-limit", arguments.noLimit,
                "let it stand (float32) or clip it (pcm16); the default with --format float32")
      ->excludes(limit);
  command
      .add_option("--events", arguments.events, "also write every impulse event to this CSV file")
      ->type_name("FILE.csv")
      ->check(fileName());
  command
      .add_flag("--stems", arguments.stems,
                "also write FILE.clicks.wav, FILE.rings.wav and FILE.contacts.wav, whose sum is "
                "FILE.wav: recoil from impacts, vibration from impacts, lasting contacts")
      ->excludes(normalize);
  addEnd(command, arguments);
  command.option_defaults()->group(kSound);
  addChoices(command, arguments);
}

CLI::App* addRender(CLI::App& app, Arguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "render",
      "Render a scene into a WAV file\n"
      "Runs the scene and computes what its listeners hear: the click of every impact, the ring of "
      "bodies that have modes, and what slides and rolls. Samples are pressures over the full "
      "scale, so that files compare in level.");
  addScene(*command, arguments);
  addSound(*command, arguments, "SCENE");
  command->option_defaults()->group(kMechanics);
  command->add_option("--stepper", arguments.stepper, "mechanics; default: the scene's choice")
      ->check(oneOf({"native", "bullet"}));
  command->add_option("--step", arguments.step, "Bullet's fixed step; default: the scene's choice")
      ->check(stepRange());
  command->footer(
      "Examples:\n"
      "  carom render marbles_in_a_box\n"
      "  carom render scenes/library/marbles_in_a_box.json -o marbles.wav\n"
      "  carom render two_balls -o balls.wav --stepper bullet --step 0.004\n"
      "  carom render bouncing_ball -o ball.wav --events ball.csv --json\n"
      "  carom render two_balls -o balls.wav --limit --full-scale 110dB\n"
      "  carom render two_balls -o balls.wav --pulse course_gaussian --sampling naive");
  return command;
}

CLI::App* addInfo(CLI::App& app, Arguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "info",
      "Say what is in a scene, and which stages it needs\n"
      "Reads a scene, or a file of 'carom record', and tells of its bodies, its listeners, and how "
      "long a run will take. With -v it also says which stages are left out, and why.");
  addScene(*command, arguments);
  command->footer("Example:\n  carom info newtons_cradle");
  return command;
}

CLI::App* addCompare(CLI::App& app, Arguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "compare",
      "Run a scene natively and on Bullet, and measure the difference\n"
      "The collisions that the bridge finds in Bullet's world are held against the exact ones of "
      "the path that Bullet took, and against those of the native stepper.");
  addScene(*command, arguments);
  command
      ->add_option("--step", arguments.steps,
                   "a step of Bullet; may be repeated; default: 1/60, 1/240 and 1/1000")
      ->check(stepRange())
      ->allow_extra_args(false);
  addLimits(*command, arguments.run);
  command->footer(
      "Examples:\n"
      "  carom compare two_balls --step 0.016667 --json\n"
      "  carom compare billiard_break --step 0.01 --step 0.001");
  return command;
}

CLI::App* addRecord(CLI::App& app, Arguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "record",
      "Run a scene, and keep the run in a file\n"
      "The file holds the motion and its events: 'carom replay' makes sound of it for other "
      "listeners without stepping again, 'carom view' and 'carom video' show it.");
  addScene(*command, arguments);
  command->add_option("-o,--output", arguments.output, "recording to write; '-' is standard output")
      ->required()
      ->type_name("FILE.carom")
      ->check(fileName());
  command->add_option("--stepper", arguments.stepper, "mechanics; default: the scene's choice")
      ->check(oneOf({"native", "bullet"}));
  addLimits(*command, arguments.run);
  command->footer(
      "Examples:\n"
      "  carom record marbles_in_a_box -o marbles.carom\n"
      "  carom replay marbles.carom -o marbles.wav");
  return command;
}

CLI::Validator timeRange() {
  const auto check = [](const std::string& text) -> std::string {
    double time = 0.0;
    if (CLI::detail::lexical_cast(text, time) && time >= 0.0 && std::isfinite(time)) return {};
    return "'" + text + "' is no time; expected a number of seconds from 0 on";
  };
  return {check, "SECONDS", "a number of seconds from 0 on"};
}

CLI::App* addReplay(CLI::App& app, Arguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "replay",
      "Render a recorded run into a WAV file, without stepping again\n"
      "Gives the samples of 'carom render', or those that other listeners hear, or a part of them. "
      "Runs that a host has recorded are replayed likewise.");
  command->add_option("FILE", arguments.scene, "file that 'carom record' wrote, or a host")
      ->required()
      ->type_name("FILE.carom");
  command->add_flag("--json", arguments.json, "print one JSON object instead of text");
  addConfine(*command, arguments.confine);
  addSound(*command, arguments, "FILE");
  command->option_defaults()->group("Part");
  command
      ->add_option("--listener", arguments.listeners,
                   "a microphone, instead of the scene's listeners; may be repeated")
      ->check(positionRange())
      ->allow_extra_args(false);
  command->add_option("--from", arguments.span.from, "begin here; default: 0")->check(timeRange());
  command->add_option("--to", arguments.span.to, "end here; default: the end")->check(timeRange());
  command->footer(
      "Examples:\n"
      "  carom replay marbles.carom -o marbles.wav\n"
      "  carom replay marbles.carom -o close.wav --listener=-0.1,0.3,0 --listener=0.1,0.3,0\n"
      "  carom replay marbles.carom -o part.wav --from 1.5 --to 2 --events part.csv");
  return command;
}

// Puts the commands under headings, in the order in which they were added.
void groupCommands(CLI::App& app) {
  const std::vector<std::pair<const char*, std::vector<const char*>>> groups = {
      {"Hear scenes and runs", {"render", "record", "replay", "jello"}},
      {"See them", {"view", "video"}},
      {"Look things up", {"scenes", "materials", "info", "events"}},
      {"Let bodies ring", {"modes", "strike", "fit"}},
      {"Use your own program", {"listen"}},
      {"Measure", {"compare", "report", "stability"}},
      {"Make many", {"batch"}},
      {"Get help", {"help", "completion"}}};
  for (const auto& [heading, names] : groups)
    for (const char* name : names)
      app.get_subcommand(name)->group(heading);
}

// Says what is of the program as a whole. Commands would inherit it if they were added later.
void addNotes(CLI::App& app) {
  app.footer(
      "Examples:\n"
      "  carom scenes\n"
      "  carom render marbles_in_a_box\n"
      "  carom events marbles_in_a_box --loudest 3\n"
      "Exit codes:\n"
      "  0  done\n"
      "  1  failed: a file cannot be written, the disk is full, a case of 'carom stability'\n"
      "  2  bad input: an option, or a scene, recording, mesh or model that is refused\n"
      "  3  ended by a limit: memory, time, events, or an endless rattle\n"
      "  129, 130, 143  ended by a signal\n"
      "Environment:\n"
      "  NO_COLOR  if it is not empty, text has no colour\n"
      "  CLICOLOR_FORCE  if it is not 0, text has colour without a terminal, too\n"
      "  XDG_CACHE_HOME  where models of bodies are kept, below carom; default: ~/.cache\n"
      "  TMPDIR  where a file that goes to standard output is made");
}

// Adds what every command has.
void addCommon(CLI::App& command, TalkFlags& flags) {
  addTalk(command, flags);
  for (CLI::App* below : command.get_subcommands([](CLI::App*) { return true; }))
    addCommon(*below, flags);
}

void applyTalk(CLI::App& command, const TalkFlags& flags) {
  if (flags.isQuiet) talk().verbosity = Verbosity::quiet;
  if (flags.isVerbose) talk().verbosity = Verbosity::verbose;
  const CLI::Option* const json = command.get_option_no_throw("--json");
  talk().isJson = json != nullptr && json->count() > 0;
}

// Parses the command line. Returns the exit code if that was all there is to do.
std::optional<int> parse(CLI::App& app, int argc, char** argv) {
  try {
    app.parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::CallForHelp&) {
    const CommandHelp help = helpOf(app);
    return answer(helpText(*findCommand(help, wordsOf(parsedCommand(app))), textWidth()));
  } catch (const CLI::CallForVersion&) {
    return answer(std::string(CAROM_VERSION) + '\n');
  } catch (const CLI::FileError& error) {
    if (parsedCommand(app).remaining().empty()) return fail(kBadInput, error.what());
    std::cerr << usageErrorText(app, error);  // what was taken for a file is the value of no option
    return kBadInput;
  } catch (const CLI::ParseError& error) {
    std::cerr << usageErrorText(app, error);
    return kBadInput;
  }
}

int run(int argc, char** argv) {
  const std::vector<std::string> program = takeProgram(argc, argv);
  CLI::App app(
      "Carom makes physics audible: every collision, slide and roll, from mass, material and "
      "shape.");
  app.name("carom");
  app.set_help_flag("-h,--help", "say this");
  app.set_version_flag("--version", CAROM_VERSION, "say the version");
  app.require_subcommand(0, 1);
  Arguments arguments;
  TalkFlags flags;
  const CLI::App* renderCommand = addRender(app, arguments);
  const CLI::App* recordCommand = addRecord(app, arguments);
  const CLI::App* replayCommand = addReplay(app, arguments);
  const JelloCommand jello(app);
  const ViewCommand view(app);
  const VideoCommand video(app);
  const ScenesCommand scenes(app);
  const MaterialsCommand materials(app);
  const CLI::App* infoCommand = addInfo(app, arguments);
  const EventsCommand events(app);
  const ModesCommand modes(app);
  const StrikeCommand strike(app);
  const FitCommand fit(app);
  const ListenCommand listen(app, program);
  const CLI::App* compareCommand = addCompare(app, arguments);
  const ReportCommand report(app);
  const StabilityCommand stability(app);
  const BatchCommand batch(app);
  const HelpCommand help(app);
  const CompletionCommand completion(app);
  addNotes(app);
  groupCommands(app);
  addCommon(app, flags);
  if (const std::optional<int> done = parse(app, argc, argv)) return *done;
  applyTalk(parsedCommand(app), flags);
  if (renderCommand->parsed()) return render(arguments);
  if (recordCommand->parsed()) return record(arguments);
  if (replayCommand->parsed()) return replay(arguments);
  if (jello.parsed()) return jello.run();
  if (view.parsed()) return view.run();
  if (video.parsed()) return video.run();
  if (scenes.parsed()) return scenes.run();
  if (materials.parsed()) return materials.run();
  if (infoCommand->parsed()) return info(arguments);
  if (events.parsed()) return events.run();
  if (modes.parsed()) return modes.run();
  if (strike.parsed()) return strike.run();
  if (fit.parsed()) return fit.run();
  if (listen.parsed()) return listen.run();
  if (compareCommand->parsed()) return compare(arguments);
  if (report.parsed()) return report.run();
  if (stability.parsed()) return stability.run();
  if (batch.parsed()) return batch.run();
  if (help.parsed()) return help.run();
  if (completion.parsed()) return completion.run();
  return answer(overviewText(helpOf(app), textWidth()));
}

}  // namespace
}  // namespace carom::command

int main(int argc, char** argv) {
  carom::command::keepStandardStreams();
  carom::command::endCleanlyOnSignals();
  try {
    carom::command::capMemory(carom::command::RunOptions().limits().memory);
    return carom::command::run(argc, argv);
  } catch (const std::bad_alloc&) {
    return carom::command::fail(carom::command::kLimited,
                                "the memory has run out before the run was over; expected a "
                                "smaller input, or more (--max-memory, by default half of the "
                                "machine's)");
  } catch (const std::exception& error) {
    return carom::command::fail(carom::command::kFailed, error.what());
  }
}
