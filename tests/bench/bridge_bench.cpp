// Cost of the bridge beside Bullet's step, and the accuracy of the collisions that it buys.

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "lab/compare/compare.h"
#include <benchmark/benchmark.h>

#include "carom/bullet/bullet_bridge.h"
#include "scenes/format/scene_loader.h"
#include "scenes/run/bullet_scene.h"
#include "tests/bench/figures.h"
#include "tests/bench/machine_yardstick.h"
#include "tests/bench/scale.h"
#include "tests/bench/thousand_balls.h"

namespace carom::bench {

using namespace lab;
using namespace scenes;

namespace {

constexpr double kStep = 1.0 / 240.0;  // s
constexpr int kWarmUp = 4;  // steps that are not measured, because memory is still growing

Scene sceneOf(Result<Scene> loaded) {
  if (!loaded) {
    std::fprintf(stderr, "%s\n", loaded.error().message.c_str());
    std::exit(1);
  }
  Scene scene = *std::move(loaded);
  scene.stepper.type = StepperType::bullet;
  scene.stepper.step = kStep;
  return scene;
}

Scene marblesInABox(const Scale& scale) {
  Scene scene = sceneOf(loadScene(CAROM_SOURCE_DIR "/scenes/library/marbles_in_a_box.json"));
  scene.duration = scale.of(scene.duration, 1.0);
  return scene;
}

Scene fallingBalls(const Scale& scale) {
  return sceneOf(thousandBalls(scale.of(0.15, 0.08)));
}

/// Ten times as many balls in ten times the space, for a shorter time.
Scene tenThousandBalls(const Scale& scale) {
  Scene scene = sceneOf(parseScene(R"({
    "duration": 0.06,
    "bodies": [
      {"type": "box", "min": [-2.15, 0, -2.15], "max": [2.15, 8.6, 2.15], "material": "steel"},
      {"type": "spheres", "count": 10000, "radius": 0.05, "material": "steel",
       "min": [-2.15, 0, -2.15], "max": [2.15, 2.6, 2.15], "speed": [0, 2]}
    ],
    "listeners": [{"position": [0, 2, 2]}]
  })",
                                   "ten_thousand_balls"));
  scene.duration = scale.of(scene.duration, 0.03);
  return scene;
}

int stepsOf(const Scene& scene) {
  return static_cast<int>(std::lround(scene.duration / kStep));
}

/// CPU time of this thread in s.
double cpuTime() {
  std::timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// A running Bullet world, with a bridge or without.
class Run {
 public:
  Run(const Scene& scene, bool bridged) : world_(scene) {
    if (!bridged) return;
    Result<BulletBridge> bridge =
        BulletBridge::attach(world_.world(), {.restSpeed = scene.stepper.restSpeed});
    if (!bridge) std::abort();
    bridge_.emplace(*std::move(bridge));
  }

  void step() {
    const double start = cpuTime();
    world_.world().stepSimulation(static_cast<btScalar>(kStep), 0);
    if (bridge_) {
      benchmark::DoNotOptimize(bridge_->events().data());
      bridge_->clear();
    }
    seconds_ += cpuTime() - start;
  }
  double seconds() const { return seconds_; }
  void forgetSeconds() { seconds_ = 0.0; }
  btVector3 place(std::size_t body) const {
    return world_.body(body).getWorldTransform().getOrigin();
  }

 private:
  BulletScene world_;
  std::optional<BulletBridge> bridge_;
  double seconds_ = 0.0;  // s, CPU time in Bullet and in the bridge
};

/// Runs the whole scene in two worlds, which take turns step by step.
void runBoth(Run& with, Run& without, const Scene& scene) {
  for (int step = 0; step < stepsOf(scene); ++step) {
    if (step == kWarmUp) {
      with.forgetSeconds();
      without.forgetSeconds();
    }
    Run& first = step % 2 == 0 ? with : without;
    Run& second = step % 2 == 0 ? without : with;
    first.step();
    second.step();
  }
}

/// True if both worlds end in the same state, bit for bit, as the bridge may change nothing.
bool endAlike(const Run& with, const Run& without, const Scene& scene) {
  for (std::size_t body = 0; body < scene.bodies.size(); ++body) {
    if (with.place(body) != without.place(body)) return false;
  }
  return true;
}

void measureShare(benchmark::State& state, const Scene& scene) {
  double with = 0.0;
  double without = 0.0;
  for ([[maybe_unused]] const auto iteration : state) {
    Run bridged(scene, true);
    Run plain(scene, false);
    runBoth(bridged, plain, scene);
    if (!endAlike(bridged, plain, scene)) return state.SkipWithError("the bridge moved a body");
    with += bridged.seconds();
    without += plain.seconds();
  }
  reportValue(state, (with - without) / without);
}

void measureStep(benchmark::State& state, const Scene& scene) {
  double seconds = 0.0;
  for ([[maybe_unused]] const auto iteration : state) {
    Run plain(scene, false);
    for (int step = 0; step < stepsOf(scene); ++step) {
      if (step == kWarmUp) plain.forgetSeconds();
      plain.step();
    }
    seconds += plain.seconds() / (stepsOf(scene) - kWarmUp);
  }
  reportValue(state, seconds / static_cast<double>(state.iterations()));
}

/// Error of the times of the scene's collisions, compared with the path that Bullet took.
std::string timeError(const Scene& scene) {
  const double steps[] = {kStep};
  const Result<CompareReport> report = compareScene(scene, steps);
  if (!report) std::abort();
  const CollisionMatch& run = report->runs.front().local;
  char text[128];
  std::snprintf(
      text, sizeof text, "time %.2g us rms, %.2g us max of %llu; missed %llu, spurious %llu",
      1e6 * run.timeError.rms, 1e6 * run.timeError.max,
      static_cast<unsigned long long>(run.matched), static_cast<unsigned long long>(run.missed),
      static_cast<unsigned long long>(run.spurious));
  return text;
}

struct BenchScene {
  std::string name;
  Scene scene;
  double bar = 0.0;    // % of Bullet's step
  double noise = 0.0;  // % of Bullet's step, between two worlds without a bridge
  std::string error;   // error of its collisions; may be empty
};

void addScene(Figures& figures, const BenchScene& bench) {
  const Scene& scene = bench.scene;
  figures.add({.name = bench.name + ", bridge",
               .unit = "% of Bullet's step",
               .subject = [scene](benchmark::State& state) { measureShare(state, scene); },
               .yardstickName = "Bullet's step",
               .fixedYardstick = 100.0,
               .bar = Bar{Bar::Of::value, bench.bar},
               .sense = Sense::lowerIsBetter,
               .error = bench.error,
               .scale = 100.0,
               .noise = bench.noise});
  figures.add({.name = bench.name + ", Bullet alone",
               .unit = "us per step",
               .subject = [scene](benchmark::State& state) { measureStep(state, scene); },
               .yardstickName = kMachine,
               .yardstick = machineTime(),
               .sense = Sense::lowerIsBetter,
               .scale = 1e6});
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  using namespace carom;
  using namespace carom::bench;
  const Scale scale = scaleOf(argc, argv);
  Figures figures;
  const Scene marbles = marblesInABox(scale);
  const Scene thousand = fallingBalls(scale);
  addScene(figures, {"marbles in a box", marbles, 3.0, scale.of(0.5, 10.0), timeError(marbles)});
  addScene(figures, {"1000 balls", thousand, 5.0, scale.of(3.0, 25.0), timeError(thousand)});
  // The error of this scene is not measured: the reference tests every pair of balls.
  addScene(figures, {"10000 balls", tenThousandBalls(scale), 5.0, scale.of(3.0, 25.0), ""});
  return figures.run(argc, argv);
}
