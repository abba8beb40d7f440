// Speed of a scene, from its file's contents to its samples, as a multiple of real time.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <benchmark/benchmark.h>

#include "scenes/format/scene_loader.h"
#include "scenes/run/scene_sound.h"
#include "scenes/run/scene_stepper.h"
#include "tests/bench/figures.h"
#include "tests/bench/scale.h"

namespace carom::bench {

using namespace scenes;

namespace {

constexpr std::size_t kBlock = 4096;  // samples

Scene libraryScene(const std::string& name, const Scale& scale) {
  Result<Scene> scene = loadScene(CAROM_SOURCE_DIR "/scenes/library/" + name + ".json");
  if (!scene) {
    std::fprintf(stderr, "%s\n", scene.error().message.c_str());
    std::exit(1);
  }
  scene->duration = scale.of(scene->duration, std::min(scene->duration, 1.0));
  return *std::move(scene);
}

Scene on(Scene scene, StepperType type) {
  scene.stepper.type = type;
  scene.stepper.step = StepperSettings{}.step;
  return scene;
}

Status render(const Scene& scene) {
  std::vector<std::vector<float>> channels(scene.listeners.size(), std::vector<float>(kBlock));
  Result<SceneSound> sound = SceneSound::create(scene);
  if (!sound) return sound.error();
  while (sound->render(channels) > 0)
    benchmark::DoNotOptimize(channels.front().data());
  return std::monostate();
}

void renderScene(benchmark::State& state, const Scene& scene) {
  for ([[maybe_unused]] const auto iteration : state) {
    if (const Status rendered = render(scene); !rendered)
      return state.SkipWithError(rendered.error().message.c_str());
  }
  reportRate(state, scene.duration);
}

void runMechanics(benchmark::State& state, const Scene& scene) {
  for ([[maybe_unused]] const auto iteration : state) {
    const Result<std::vector<ImpulseEvent>> events = sceneEvents(scene);
    if (!events) return state.SkipWithError(events.error().message.c_str());
    benchmark::DoNotOptimize(events->data());
  }
  reportRate(state, scene.duration);
}

std::string collisions(const Scene& scene) {
  const Result<std::vector<ImpulseEvent>> events = sceneEvents(scene);
  return events ? std::to_string(events->size() / 2) + " collisions" : "";
}

void addScene(Figures& figures, const Scene& scene) {
  // The first sound of a process makes tables; an error here occurs again in the measurement.
  static_cast<void>(render(scene));
  const bool bullet = scene.stepper.type == StepperType::bullet;
  figures.add({.name = scene.name + (bullet ? ", Bullet at 1/240 s" : ", native"),
               .unit = "x real time",
               .subject = [scene](benchmark::State& state) { renderScene(state, scene); },
               .yardstickName = "mechanics alone, " + collisions(scene),
               .yardstick = [scene](benchmark::State& state) { runMechanics(state, scene); },
               .sense = Sense::higherIsBetter});
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  using namespace carom::bench;
  const Scale scale = scaleOf(argc, argv);
  Figures figures;
  const carom::scenes::Scene marbles = libraryScene("marbles_in_a_box", scale);
  addScene(figures, on(marbles, carom::scenes::StepperType::native));
  addScene(figures, on(marbles, carom::scenes::StepperType::bullet));
  for (const char* name : {"billiard_break", "bouncing_ball", "newtons_cradle"})
    addScene(figures, on(libraryScene(name, scale), carom::scenes::StepperType::native));
  return figures.run(argc, argv);
}
