#include "lab/compare/compare.h"

#include <cmath>
#include <memory>
#include <vector>

#include "lab/compare/local_reference.h"

#include "carom/bullet/bullet_bridge.h"
#include "scenes/recording/event_tape.h"
#include "scenes/run/bullet_scene.h"
#include "scenes/run/native_only.h"
#include "scenes/run/scene_sound.h"
#include "scenes/run/scene_stepper.h"
#include "scenes/run/stopwatch.h"

namespace carom::lab {

using namespace scenes;
namespace {

struct BulletRun {
  std::vector<Collision> reported;
  std::vector<Collision> reference;
  double wallTime = 0.0;
};

Result<BulletRun> runBullet(const Scene& scene, RunGuard* guard) {
  if (guard != nullptr) guard->restart();
  BulletScene world(scene);
  Result<BulletBridge> bridge = BulletBridge::attach(
      world.world(), {.restSpeed = scene.stepper.restSpeed, .delivery = EventDelivery::prompt});
  if (!bridge) return bridge.error();
  LocalReference reference(scene);
  BulletRun run;
  std::size_t counted = 0;  // events that the guard knows of
  const auto step = static_cast<btScalar>(scene.stepper.step);
  while (bridge->settledTime() < scene.duration) {
    reference.beforeStep(world);
    const Stopwatch stopwatch;
    world.world().stepSimulation(step, 0);
    run.wallTime += stopwatch.seconds();
    reference.afterStep(world, static_cast<double>(step));
    const auto more = bridge->events().subspan(counted);
    counted += more.size();
    if (guard != nullptr) guard->add(more, bridge->settledTime());
    if (Status ended = checkEnded(guard); !ended) return ended.error();
  }
  const auto late = [&](const Collision& c) { return c.time > scene.duration; };
  run.reported = collisionsOf(bridge->events());
  run.reference = reference.collisions();
  std::erase_if(run.reported, late);
  std::erase_if(run.reference, late);
  return run;
}

// Returns the root mean square of a scene's pressure over all channels, Pa.
Result<double> soundLevel(const Scene& scene, RunGuard* guard) {
  Result<SceneSound> sound = SceneSound::create(scene, withinLimits(guard, {}));
  if (!sound) return sound.error();
  if (guard != nullptr) {
    guard->restart();
    sound->watch(*guard);
  }
  std::vector<std::vector<float>> channels(sound->synth().channelCount(), std::vector<float>(4096));
  double sum = 0.0;
  while (const std::size_t frames = sound->render(channels)) {
    for (const auto& channel : channels) {
      for (std::size_t frame = 0; frame < frames; ++frame) {
        sum += static_cast<double>(channel[frame]) * static_cast<double>(channel[frame]);
      }
    }
  }
  if (Status ended = checkEnded(guard); !ended) return ended.error();
  return std::sqrt(sum / static_cast<double>(sound->frames()) /
                   static_cast<double>(channels.size()));
}

Scene onBullet(const Scene& scene, double step) {
  Scene bullet = scene;
  bullet.stepper.type = StepperType::bullet;
  bullet.stepper.step = step;
  return bullet;
}

}  // namespace

Result<CompareReport> compareScene(const Scene& scene, std::span<const double> steps,
                                   const CompareOptions& options) {
  if (const Status valid = validateForBullet(scene); !valid)
    return Error{scene.name + ": " + valid.error().message};
  Scene native = scene;
  native.stepper.type = StepperType::native;
  CompareReport report;
  const Stopwatch stopwatch;
  const Result<std::unique_ptr<SceneStepper>> stepper = makeStepper(native);
  if (!stepper) return stepper.error();
  const Result<EventTape> tape = recordTape(**stepper, native.duration, options.guard);
  if (!tape) return tape.error();
  report.nativeWallTime = stopwatch.seconds();
  const std::vector<Collision> nativeCollisions = collisionsOf(eventsOf(*tape));
  report.nativeCollisions = nativeCollisions.size();
  const Result<double> nativeLevel = soundLevel(native, options.guard);
  if (!nativeLevel) return nativeLevel.error();

  for (const double step : steps) {
    const Scene bullet = onBullet(scene, step);
    const Result<BulletRun> run = runBullet(bullet, options.guard);
    if (!run) return run.error();
    const Result<double> level = soundLevel(bullet, options.guard);
    if (!level) return level.error();
    CompareRun& result = report.runs.emplace_back();
    result.step = step;
    result.wallTime = run->wallTime;
    result.local = matchCollisions(run->reported, run->reference, step);
    result.global = commonRun(run->reported, nativeCollisions, 4.0 * step + 0.01);
    result.levelDifference = 20.0 * std::log10(*level / *nativeLevel);
    if (options.progress)
      options.progress(static_cast<double>(report.runs.size()) / static_cast<double>(steps.size()));
  }
  return report;
}

}  // namespace carom::lab
