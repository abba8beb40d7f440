// What a scene pays for what it does not need: features that are linked in, and features that are
// configured and never come into play. Each figure is beside the same scene without them.

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "scenes/memory_use.h"
#include "scenes/scene_loader.h"
#include "scenes/scene_sound.h"
#include "scenes/scene_stepper.h"
#include "tests/bench/figures.h"

namespace carom::bench {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBlock = 4096;  // samples
constexpr Bar kFree = {Bar::Of::ratio, 1.02};

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

/// Eighty marbles for two seconds, with nothing but clicks: no roughness, nobody rings.
Scene plain() {
  Scene scene = orExit(loadScene(libraryFile("marbles_in_a_box")));
  scene.duration = 2.0;
  for (SceneBody& body : scene.bodies)
    body.material.roughness = {};
  return scene;
}

/// What can be configured in a scene, and is not needed by these marbles.
struct Feature {
  std::string name;
  Scene scene;
};

SceneBody farBell() {
  SceneBody bell = {"bell", *findMaterial("steel"),
                    SphereShape{.radius = 0.1, .mass = 32.0, .position = {0.0, 500.0, 500.0}}};
  bell.ringing = Ringing{};
  bell.ringing->analysis.degreesOfFreedom = 2000;
  return bell;
}

std::vector<Feature> features() {
  std::vector<Feature> all;
  Scene rough = plain();
  for (SceneBody& body : rough.bodies)
    body.material.roughness = findMaterial("brick")->roughness;
  all.push_back({"bumps on every body", std::move(rough)});
  Scene bell = plain();
  bell.gravity = Vec3::Zero();
  bell.bodies.push_back(farBell());
  all.push_back({"a bell that nothing strikes", std::move(bell)});
  Scene loss = plain();
  loss.sound.contactLoss = 0.5;
  loss.sound.modalRadiation = ModalRadiation::monopole;
  loss.mostModes = 16;
  all.push_back({"settings of modes without modes", std::move(loss)});
  return all;
}

/// The same scene without the feature.
Scene without(const Feature& feature) {
  Scene scene = plain();
  scene.gravity = feature.scene.gravity;
  return scene;
}

using Channels = std::vector<std::vector<float>>;

template <class Heard>
void render(const Scene& scene, const Heard& heard) {
  SceneSound sound = orExit(SceneSound::create(scene));
  Channels channels(channelsOf(scene), std::vector<float>(kBlock));
  while (const std::size_t frames = sound.render(channels))
    heard(channels, frames);
}

/// The stages by hand, in the order of the data: what no plan could leave out.
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

void timeOf(benchmark::State& state, const Scene& scene, const Renderer& renderer) {
  for ([[maybe_unused]] const auto iteration : state)
    renderer([](const Channels& channels, std::size_t) {
      benchmark::DoNotOptimize(channels.front().data());
    });
  reportTime(state, scene.duration);
}

void memoryOf(benchmark::State& state, const Renderer& renderer) {
  std::size_t most = 0;
  const std::size_t before = heapInUse().value_or(0);
  for ([[maybe_unused]] const auto iteration : state)
    renderer(
        [&most](const Channels&, std::size_t) { most = std::max(most, heapInUse().value_or(0)); });
  reportValue(state, static_cast<double>(most) - static_cast<double>(before));
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
  std::string yardstick;
  Renderer without;
};

void addPair(Figures& figures, const Pair& pair) {
  const bool same = samplesOf(pair.with) == samplesOf(pair.without);
  const std::string error = same ? "the same samples" : "other samples";
  const Scene scene = pair.scene;
  const Renderer with = pair.with;
  const Renderer without = pair.without;
  figures.add({.name = pair.name + ": time",
               .unit = "ms per s",
               .subject = [=](benchmark::State& state) { timeOf(state, scene, with); },
               .yardstickName = pair.yardstick,
               .yardstick = [=](benchmark::State& state) { timeOf(state, scene, without); },
               .bar = kFree,
               .sense = Sense::lowerIsBetter,
               .error = error,
               .scale = 1e3});
  figures.add({.name = pair.name + ": heap",
               .unit = "kB",
               .subject = [=](benchmark::State& state) { memoryOf(state, with); },
               .yardstickName = pair.yardstick,
               .yardstick = [=](benchmark::State& state) { memoryOf(state, without); },
               .bar = kFree,
               .sense = Sense::lowerIsBetter,
               .error = error,
               .scale = 1e-3});
}

Renderer whole(const Scene& scene) {
  return [scene](const auto& heard) { render(scene, heard); };
}

/// What a child process used.
struct Usage {
  double seconds = 0.0;  // of processor time
  double bytes = 0.0;    // resident at most
  bool worked = false;
};

Usage usageOf(std::vector<std::string> arguments) {
  std::vector<char*> pointers;
  pointers.reserve(arguments.size() + 1);
  for (std::string& argument : arguments)
    pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  const pid_t child = vfork();
  if (child == 0) {
    execv(pointers.front(), pointers.data());
    _exit(127);
  }
  int status = 0;
  rusage used{};
  if (child < 0 || wait4(child, &status, 0, &used) != child) return {};
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return {seconds(used.ru_utime) + seconds(used.ru_stime),
          1024.0 * static_cast<double>(used.ru_maxrss),
          WIFEXITED(status) && WEXITSTATUS(status) == 0};
}

std::string contentsOf(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

void addProcesses(Figures& figures) {
  const fs::path folder = fs::temp_directory_path();
  const std::string all = folder / ("carom_plan_all_" + std::to_string(getpid()) + ".wav");
  const std::string bare = folder / ("carom_plan_bare_" + std::to_string(getpid()) + ".wav");
  // Without standard output: the command says what it did.
  const std::vector<std::string> command = {"/bin/sh", "-c",
                                            std::string("exec " CAROM_COMMAND " render '") +
                                                libraryFile("newtons_cradle") + "' -o " + all +
                                                " >/dev/null"};
  const std::vector<std::string> byHand = {CAROM_PLAN_BARE, bare};
  const bool worked = usageOf(command).worked && usageOf(byHand).worked;
  const bool same = worked && contentsOf(all) == contentsOf(bare);
  fs::remove(all);
  fs::remove(bare);
  const auto add = [&](const std::string& name, const std::string& unit, double Usage::*part,
                       double scale) {
    const auto measure = [part](const std::vector<std::string>& arguments,
                                const std::string& file) {
      return [part, arguments, file](benchmark::State& state) {
        Usage usage;
        for ([[maybe_unused]] const auto iteration : state)
          usage = usageOf(arguments);
        fs::remove(file);
        if (!usage.worked) return state.SkipWithError("the process failed");
        reportValue(state, usage.*part);
      };
    };
    figures.add({.name = name,
                 .unit = unit,
                 .subject = measure(command, all),
                 .yardstickName = "a program of native and audio alone",
                 .yardstick = measure(byHand, bare),
                 .sense = Sense::lowerIsBetter,
                 .error = same ? "the same file" : "another file",
                 .scale = scale});
  };
  add("carom render, the process: processor time", "ms", &Usage::seconds, 1e3);
  add("carom render, the process: memory", "MB", &Usage::bytes, 1e-6);
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  using namespace carom::bench;
  Figures figures;
  const carom::Scene scene = plain();
  addPair(figures, {"everything linked in", scene, whole(scene), "stages by hand",
                    [scene](const auto& heard) { renderByHand(scene, heard); }});
  for (const Feature& feature : features())
    addPair(figures, {feature.name, feature.scene, whole(feature.scene), "without it",
                      whole(without(feature))});
  addProcesses(figures);
  return figures.run(argc, argv);
}
