// Cost of features that a scene does not need: those that are linked in, and those that are
// configured and never come into play, beside the same scene without them. Prints a table.

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "lab/report/memory_use.h"
#include <unistd.h>

#include "scenes/format/scene_loader.h"
#include "scenes/run/scene_sound.h"
#include "scenes/run/scene_stepper.h"
#include "scenes/run/stopwatch.h"
#include "tests/bench/table_program.h"

namespace carom::bench {

using namespace lab;
using namespace scenes;

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBlock = 4096;  // samples
constexpr double kFree = 1.02;        // bar: cost relative to the scene without the feature
constexpr char kHelp[] =
    R"(usage: bench_plan [--short]
       ./bench plan [--short]

What a scene pays for features that are linked in, and for those that are configured and never come
into play, beside the same scene without them.
)";

template <class T>
T orExit(Result<T> result) {
  if (!result) {
    std::fprintf(stderr, "%s\n", result.error().message.c_str());
    std::exit(1);
  }
  return *std::move(result);
}

std::string libraryFile(const std::string& name) {
  return CAROM_SOURCE_DIR "/scenes/library/" + name + ".json";
}

/// The number of runs, and their length.
struct Effort {
  int runs = 25;
  double duration = 2.0;  // s of simulation
};

/// A scene with nothing but clicks: no body is rough or rings. By default it has eighty marbles.
Scene plain(const Effort& effort, const std::string& name = "marbles_in_a_box") {
  Scene scene = orExit(loadScene(libraryFile(name)));
  scene.duration = effort.duration;
  for (SceneBody& body : scene.bodies)
    body.material.roughness = {};
  return scene;
}

/// A feature that a scene configures and does not need.
struct Feature {
  std::string name;
  Scene scene;
  Scene without;
};

SceneBody farBell() {
  SceneBody bell = {"bell", *findMaterial("steel"),
                    SphereShape{.radius = 0.1, .mass = 32.0, .position = {0.0, 500.0, 500.0}}};
  bell.ringing = Ringing{};
  bell.ringing->analysis.solid.grid.degreesOfFreedom = 2000;
  bell.ringing->analysis.radiation.reset();
  return bell;
}

std::vector<Feature> features(const Effort& effort) {
  std::vector<Feature> all;
  Scene rough = plain(effort);
  for (SceneBody& body : rough.bodies)
    body.material.roughness = findMaterial("concrete")->roughness;
  all.push_back({"bumps on every body", std::move(rough), plain(effort)});
  Scene bell = plain(effort, "newtons_cradle");
  bell.bodies.push_back(farBell());
  all.push_back({"a bell that nothing strikes", std::move(bell), plain(effort, "newtons_cradle")});
  Scene loss = plain(effort);
  loss.sound.contactLoss = 0.5;
  loss.sound.modalRadiation = ModalRadiation::monopole;
  loss.mostModes = 16;
  all.push_back({"settings of modes without modes", std::move(loss), plain(effort)});
  return all;
}

using Channels = std::vector<std::vector<float>>;

template <class Heard>
void render(const Scene& scene, const Heard& heard) {
  SceneSound sound = orExit(SceneSound::create(scene));
  Channels channels(channelsOf(scene), std::vector<float>(kBlock));
  heard(channels, 0);
  while (const std::size_t frames = sound.render(channels))
    heard(channels, frames);
}

/// Renders by hand, with only the stages that no plan could leave out, in the order of the data.
template <class Heard>
void renderByHand(const Scene& scene, const Heard& heard) {
  SphereStepper stepper = orExit(nativeStepper(scene));
  SynthSettings settings = scene.sound;
  settings.sampleRate = scene.sampleRate;
  settings.medium = scene.medium;
  Synth synth = orExit(Synth::create(settings, scene.listeners));
  for (std::size_t id = 0; id < scene.bodies.size(); ++id) {
    SoundBody body;
    body.material = scene.bodies[id].material;
    if (const auto* sphere = std::get_if<SphereShape>(&scene.bodies[id].shape)) {
      body.mass = sphere->mass;
      body.radius = sphere->radius;
    }
    orExit(synth.setBody(static_cast<BodyId>(id), body));
  }
  Channels channels(channelsOf(scene), std::vector<float>(kBlock));
  heard(channels, 0);
  const auto frames = static_cast<std::size_t>(scene.duration * scene.sampleRate);
  for (std::size_t done = 0; done < frames; done += kBlock) {
    const std::size_t count = std::min(kBlock, frames - done);
    const double time = static_cast<double>(done + count) / scene.sampleRate + 0.1;
    for (const ImpulseEvent& event : stepper.advanceTo(std::min(time, scene.duration)))
      synth.schedule(event);
    std::array<float*, 8> pointers{};
    for (std::size_t channel = 0; channel < channels.size(); ++channel)
      pointers.at(channel) = channels[channel].data();
    synth.render<float>({pointers.data(), channels.size()}, count);
    heard(channels, count);
  }
}

using Renderer = std::function<void(const std::function<void(const Channels&, std::size_t)>&)>;

/// Cost of rendering, without preparing it.
struct Cost {
  double seconds = std::numeric_limits<double>::infinity();  // per simulated second
  double bytes = 0.0;                                        // largest heap, with the prepared data

  void takeSmaller(const Cost& other) {
    seconds = std::min(seconds, other.seconds);
    bytes = std::max(bytes, other.bytes);
  }
};

Cost costOf(const Renderer& renderer, double duration) {
  const std::size_t before = heapInUse().value_or(0);
  std::size_t most = before;
  std::optional<Stopwatch> stopwatch;
  renderer([&](const Channels&, std::size_t frames) {
    if (frames == 0) {
      most = std::max(most, heapInUse().value_or(0));
      stopwatch.emplace();
    }
  });
  Cost cost;
  cost.seconds = stopwatch->seconds() / duration;
  renderer([&](const Channels&, std::size_t) { most = std::max(most, heapInUse().value_or(0)); });
  cost.bytes = static_cast<double>(most - before);
  return cost;
}

std::vector<float> samplesOf(const Renderer& renderer) {
  std::vector<float> samples;
  renderer([&samples](const Channels& channels, std::size_t frames) {
    for (const std::vector<float>& channel : channels)
      samples.insert(samples.end(), channel.begin(),
                     channel.begin() + static_cast<std::ptrdiff_t>(frames));
  });
  return samples;
}

struct Pair {
  std::string name;
  Scene scene;
  Renderer with;
  Renderer without;
};

void printRow(const std::string& name, const std::string& unit, double with, double without,
              const std::string& bar, const std::string& verdict, bool same) {
  std::printf("| %s | %.4g %s | %.4g %s | %.3f | %s | %s | %s |\n", name.c_str(), with,
              unit.c_str(), without, unit.c_str(), with / without, bar.c_str(), verdict.c_str(),
              same ? "the same" : "other");
}

void printPair(const Pair& pair, int runs) {
  const bool same = samplesOf(pair.with) == samplesOf(pair.without);
  Cost with;
  Cost without;
  // The two take turns, and the least time of each counts: the machine's other work only adds.
  for (int run = 0; run < runs; ++run) {
    with.takeSmaller(costOf(pair.with, pair.scene.duration));
    without.takeSmaller(costOf(pair.without, pair.scene.duration));
  }
  const double ratio = with.seconds / without.seconds;
  printRow(pair.name + ": time", "ms/s", 1e3 * with.seconds, 1e3 * without.seconds, "<= 1.02",
           ratio <= kFree ? "holds" : "falls short", same);
  printRow(pair.name + ": heap", "kB", 1e-3 * with.bytes, 1e-3 * without.bytes, "<= 1.02",
           with.bytes / without.bytes <= kFree ? "holds" : "falls short", same);
}

Renderer whole(const Scene& scene) {
  return [scene](const auto& heard) { render(scene, heard); };
}

/// Resources that a child process used.
struct Usage {
  double seconds = 0.0;  // s of CPU time
  double bytes = 0.0;    // largest resident size
  bool worked = false;
};

/// Runs a program, with arguments that contain no double quotes, and returns its usage.
Usage usageOf(const std::string& program, const std::string& arguments) {
  const std::string command = "'" CAROM_PROCESS_USAGE "' '" + program + "' " + arguments;
  FILE* said = popen(command.c_str(), "r");
  if (said == nullptr) return {};
  Usage usage;
  const int read = std::fscanf(said, "%lf %lf", &usage.seconds, &usage.bytes);
  usage.worked = pclose(said) == 0 && read == 2;
  return usage;
}

std::string contentsOf(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

void printProcesses(int runs) {
  const fs::path folder = fs::temp_directory_path();
  const std::string all = folder / ("carom_plan_all_" + std::to_string(getpid()) + ".wav");
  const std::string bare = folder / ("carom_plan_bare_" + std::to_string(getpid()) + ".wav");
  const std::string arguments = "render '" + libraryFile("newtons_cradle") + "' -o '" + all + "'";
  Usage with{std::numeric_limits<double>::infinity(), 0.0, true};
  Usage without = with;
  for (int run = 0; run < runs; ++run) {
    const Usage one = usageOf(CAROM_COMMAND, arguments);
    const Usage other = usageOf(CAROM_PLAN_BARE, "'" + bare + "'");
    with = {std::min(with.seconds, one.seconds), one.bytes, with.worked && one.worked};
    without = {std::min(without.seconds, other.seconds), other.bytes,
               without.worked && other.worked};
  }
  const bool same = with.worked && without.worked && contentsOf(all) == contentsOf(bare);
  fs::remove(all);
  fs::remove(bare);
  printRow("`carom render`, the process: processor time", "ms", 1e3 * with.seconds,
           1e3 * without.seconds, "none", "", same);
  printRow("`carom render`, the process: memory", "MB", 1e-6 * with.bytes, 1e-6 * without.bytes,
           "none", "", same);
}

int run(const Scale& scale) {
  const Effort effort = scale.of<Effort>({}, {.runs = 2, .duration = 0.5});
  std::printf(
      "| what | with | without | ratio | bar | | samples |\n|---|---|---|---|---|---|---|\n");
  const Scene scene = plain(effort);
  printPair({"everything linked in, beside the stages by hand", scene, whole(scene),
             [scene](const auto& heard) { renderByHand(scene, heard); }},
            effort.runs);
  for (const Feature& feature : features(effort))
    printPair({feature.name, feature.scene, whole(feature.scene), whole(feature.without)},
              effort.runs);
  printProcesses(effort.runs);
  return 0;
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  return carom::bench::TableProgram{"bench_plan", carom::bench::kHelp, carom::bench::run}.main(
      argc, argv);
}
