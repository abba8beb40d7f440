// The carom command: render, info, compare. Exit codes: 0 done, 1 failed, 2 bad input.

#include <cstdio>
#include <exception>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "scenes/compare.h"
#include "scenes/plan.h"
#include "scenes/progress_bar.h"
#include "scenes/render.h"
#include "scenes/report_text.h"
#include "scenes/scene_loader.h"

namespace carom {
namespace {

constexpr int kDone = 0;
constexpr int kFailed = 1;
constexpr int kBadInput = 2;

int fail(int code, const std::string& message) {
  std::cerr << "carom: " << message << '\n';
  return code;
}

struct Arguments {
  std::string scene;
  bool json = false;
  // render
  std::string output;
  std::string events;
  std::string format = "float32";
  bool normalize = false;
  std::string stepper;
  double step = 0.0;  // 0: the scene's own
  // compare
  std::vector<double> steps;
};

void applyStepper(const Arguments& arguments, Scene& scene) {
  if (arguments.stepper == "native") scene.stepper.type = StepperType::native;
  if (arguments.stepper == "bullet") scene.stepper.type = StepperType::bullet;
  if (arguments.step > 0.0) scene.stepper.step = arguments.step;
}

int render(const Arguments& arguments) {
  Result<Scene> scene = loadScene(arguments.scene);
  if (!scene) return fail(kBadInput, scene.error().message);
  applyStepper(arguments, *scene);
  if (arguments.step > 0.0 && scene->stepper.type == StepperType::native) {
    return fail(kBadInput,
                "--step: the native stepper has no step; expected --stepper bullet with it");
  }
  ProgressBar bar("rendering " + scene->name);
  RenderOptions options;
  options.soundFile = arguments.output;
  options.format = arguments.format == "pcm16" ? SampleFormat::pcm16 : SampleFormat::float32;
  options.normalize = arguments.normalize;
  if (!arguments.events.empty()) options.eventsFile = arguments.events;
  options.progress = [&](double share) { bar.show(share); };
  const Result<RenderReport> report = renderScene(*scene, options);
  if (!report) return fail(kFailed, report.error().message);
  bar.clear();
  if (report->clippedSamples > 0) {
    std::cerr << "carom: " << arguments.output << ": " << report->clippedSamples
              << " samples exceed full scale and were clipped; --format float32 keeps them, "
                 "--normalize scales the file down\n";
  }
  if (report->synth.late > 0) {
    std::cerr << "carom: " << report->synth.late
              << " contacts last longer than 50 ms and lost the "
                 "beginning of their sound\n";
  }
  std::cout << (arguments.json ? renderJson(*report).dump(2) + "\n" : renderText(*report));
  return kDone;
}

int info(const Arguments& arguments) {
  const Result<Scene> scene = loadScene(arguments.scene);
  if (!scene) return fail(kBadInput, scene.error().message);
  std::cout << (arguments.json ? infoJson(*scene).dump(2) + "\n" : infoText(*scene));
  return kDone;
}

int compare(const Arguments& arguments) {
  const Result<Scene> scene = loadScene(arguments.scene);
  if (!scene) return fail(kBadInput, scene.error().message);
  std::vector<double> steps = arguments.steps;
  if (steps.empty()) steps = {1.0 / 60.0, 1.0 / 240.0, 1.0 / 1000.0};
  ProgressBar bar("comparing " + scene->name);
  const Result<CompareReport> report =
      compareScene(*scene, steps, [&](double share) { bar.show(share); });
  if (!report) return fail(kFailed, report.error().message);
  bar.clear();
  std::cout << (arguments.json ? compareJson(*scene, *report).dump(2) + "\n"
                               : compareText(*scene, *report));
  return kDone;
}

// A step that Bullet can take; the same as in scene files. (CLI::Range lets NaN pass.)
CLI::Validator stepRange() {
  const auto check = [](const std::string& text) -> std::string {
    double step = 0.0;
    if (CLI::detail::lexical_cast(text, step) && step >= kShortestStep && step <= kLongestStep) {
      return {};
    }
    return text + " is not a step; expected a number from 1e-5 to 0.1 (seconds)";
  };
  return {check, "SECONDS"};
}

void addScene(CLI::App& command, Arguments& arguments) {
  command.add_option("SCENE", arguments.scene, "scene file (JSON, docs/scenes.md)")->required();
  command.add_flag("--json", arguments.json, "print one JSON object instead of text");
}

CLI::App* addRender(CLI::App& app, Arguments& arguments) {
  CLI::App* command = app.add_subcommand("render", "Render a scene into a WAV file");
  addScene(*command, arguments);
  command->add_option("-o,--output", arguments.output, "WAV file to write")->required();
  command->add_option("--stepper", arguments.stepper, "mechanics; default: the scene's choice")
      ->check(CLI::IsMember({"native", "bullet"}));
  command->add_option("--step", arguments.step, "Bullet's fixed step in seconds")
      ->check(stepRange());
  command->add_option("--events", arguments.events,
                      "also write every impulse event to this CSV file");
  command->add_option("--format", arguments.format, "sample format")
      ->check(CLI::IsMember({"float32", "pcm16"}))
      ->capture_default_str();
  command->add_flag("--normalize", arguments.normalize,
                    "scale the file to full scale; otherwise 1.0 is 20 Pa in every file");
  command->footer(
      "Examples:\n"
      "  carom render scenes/library/marbles_in_a_box.json -o marbles.wav\n"
      "  carom render scenes/library/two_balls.json -o balls.wav --stepper bullet --step 0.004\n"
      "  carom render scenes/library/bouncing_ball.json -o ball.wav --events ball.csv --json");
  return command;
}

CLI::App* addInfo(CLI::App& app, Arguments& arguments) {
  CLI::App* command =
      app.add_subcommand("info", "Say what is in a scene, and which stages it needs");
  addScene(*command, arguments);
  command->footer("Example:\n  carom info scenes/library/newtons_cradle.json");
  return command;
}

CLI::App* addCompare(CLI::App& app, Arguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "compare", "Run a scene natively and on Bullet, and measure the difference");
  addScene(*command, arguments);
  command
      ->add_option("--step", arguments.steps,
                   "a Bullet step in seconds; may be repeated; default: 1/60, 1/240 and 1/1000")
      ->check(stepRange())
      ->allow_extra_args(false);
  command->footer(
      "Examples:\n"
      "  carom compare scenes/library/two_balls.json --step 0.016667 --json\n"
      "  carom compare scenes/library/billiard_break.json --step 0.01 --step 0.001");
  return command;
}

int run(int argc, char** argv) {
  CLI::App app("Carom: physically based contact sound");
  app.name("carom");
  app.set_version_flag("--version", CAROM_VERSION);
  app.require_subcommand(1);
  app.footer("carom COMMAND --help shows the options of a command, with examples.");
  Arguments arguments;
  const CLI::App* renderCommand = addRender(app, arguments);
  const CLI::App* infoCommand = addInfo(app, arguments);
  addCompare(app, arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kBadInput;
  }
  if (renderCommand->parsed()) return render(arguments);
  if (infoCommand->parsed()) return info(arguments);
  return compare(arguments);
}

}  // namespace
}  // namespace carom

int main(int argc, char** argv) {
  try {
    return carom::run(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "carom: " << error.what() << '\n';
  }
  return 1;
}
