#include "scenes/compare.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <utility>

#include "bullet_bridge/bullet_bridge.h"
#include "scenes/bullet_scene.h"
#include "scenes/local_reference.h"
#include "scenes/native_only.h"
#include "scenes/scene_sound.h"
#include "scenes/scene_stepper.h"

namespace carom {
namespace {

using Pair = std::pair<BodyId, BodyId>;

class Errors {
 public:
  void add(double error) {
    sumOfSquares_ += error * error;
    max_ = std::max(max_, std::abs(error));
    ++count_;
  }
  std::uint64_t count() const { return count_; }
  ErrorSummary summary() const {
    return count_ == 0 ? ErrorSummary{}
                       : ErrorSummary{std::sqrt(sumOfSquares_ / static_cast<double>(count_)), max_};
  }

 private:
  double sumOfSquares_ = 0.0;
  double max_ = 0.0;
  std::uint64_t count_ = 0;
};

class Stopwatch {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

// Collisions from events: of the two shares, the one of the lower id, in order of time.
std::vector<ReferenceCollision> collisionsOf(std::span<const ImpulseEvent> events) {
  std::vector<ReferenceCollision> collisions;
  for (const ImpulseEvent& event : events) {
    if (event.body > event.other) continue;
    collisions.push_back({event.body, event.other, event.time, event.impulse.norm()});
  }
  std::stable_sort(collisions.begin(), collisions.end(),
                   [](const auto& a, const auto& b) { return a.time < b.time; });
  return collisions;
}

using ByPair = std::map<Pair, std::vector<ReferenceCollision>>;

ByPair byPair(const std::vector<ReferenceCollision>& collisions) {
  ByPair sorted;
  for (const ReferenceCollision& collision : collisions) {
    sorted[{collision.body, collision.other}].push_back(collision);
  }
  return sorted;
}

struct BulletRun {
  std::vector<ReferenceCollision> reported;
  std::vector<ReferenceCollision> reference;
  double wallTime = 0.0;
};

Result<BulletRun> runBullet(const Scene& scene) {
  BulletScene world(scene);
  Result<BulletBridge> bridge = BulletBridge::attach(
      world.world(), {.restSpeed = scene.stepper.restSpeed, .delivery = EventDelivery::prompt});
  if (!bridge) return bridge.error();
  LocalReference reference(scene);
  BulletRun run;
  const auto step = static_cast<btScalar>(scene.stepper.step);
  while (bridge->settledTime() < scene.duration) {
    reference.beforeStep(world);
    const Stopwatch stopwatch;
    world.world().stepSimulation(step, 0);
    run.wallTime += stopwatch.seconds();
    reference.afterStep(world, static_cast<double>(step));
  }
  const auto late = [&](const ReferenceCollision& c) { return c.time > scene.duration; };
  run.reported = collisionsOf(bridge->events());
  run.reference = reference.collisions();
  std::erase_if(run.reported, late);
  std::erase_if(run.reference, late);
  return run;
}

// Each reported collision takes the nearest reference of its pair that is still free.
void compareLocally(const BulletRun& run, CompareRun& result) {
  ByPair reference = byPair(run.reference);
  Errors time;
  Errors impulse;
  for (const ReferenceCollision& reported : run.reported) {
    auto& candidates = reference[{reported.body, reported.other}];
    const auto nearest =
        std::min_element(candidates.begin(), candidates.end(), [&](const auto& a, const auto& b) {
          return std::abs(a.time - reported.time) < std::abs(b.time - reported.time);
        });
    if (nearest == candidates.end() || std::abs(nearest->time - reported.time) > result.step) {
      ++result.spurious;
      continue;
    }
    time.add(reported.time - nearest->time);
    impulse.add(reported.impulse / nearest->impulse - 1.0);
    candidates.erase(nearest);
  }
  result.reference = run.reference.size();
  result.matched = time.count();
  result.missed = result.reference - result.matched;
  result.timeError = time.summary();
  result.impulseError = impulse.summary();
}

// Where the collisions of one pair stop agreeing between the two runs.
double divergence(const std::vector<ReferenceCollision>& a,
                  const std::vector<ReferenceCollision>& b, double limit) {
  for (std::size_t i = 0; i < std::max(a.size(), b.size()); ++i) {
    if (i >= a.size()) return b[i].time;
    if (i >= b.size()) return a[i].time;
    if (std::abs(a[i].time - b[i].time) > limit) return std::min(a[i].time, b[i].time);
  }
  return std::numeric_limits<double>::infinity();
}

void compareGlobally(const BulletRun& run, const std::vector<ReferenceCollision>& native,
                     CompareRun& result) {
  ByPair bullet = byPair(run.reported);
  ByPair exact = byPair(native);
  for (const auto& [pair, collisions] : bullet)
    exact[pair];
  const double limit = 4.0 * result.step + 0.01;
  for (const auto& [pair, collisions] : exact) {
    result.divergedAt = std::min(result.divergedAt, divergence(collisions, bullet[pair], limit));
  }
  Errors difference;
  for (const auto& [pair, collisions] : exact) {
    const auto& other = bullet[pair];
    for (std::size_t i = 0; i < std::min(collisions.size(), other.size()); ++i) {
      if (std::max(collisions[i].time, other[i].time) >= result.divergedAt) break;
      difference.add(other[i].time - collisions[i].time);
    }
  }
  result.globalCompared = difference.count();
  result.globalDifference = difference.summary();
}

// Root mean square of a scene's pressure over all channels, Pa.
Result<double> soundLevel(const Scene& scene) {
  Result<SceneSound> sound = SceneSound::create(scene);
  if (!sound) return sound.error();
  std::vector<std::vector<float>> channels(sound->synth().channelCount(), std::vector<float>(4096));
  double sum = 0.0;
  while (const std::size_t frames = sound->render(channels)) {
    for (const auto& channel : channels) {
      for (std::size_t frame = 0; frame < frames; ++frame) {
        sum += static_cast<double>(channel[frame]) * static_cast<double>(channel[frame]);
      }
    }
  }
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
                                   const std::function<void(double share)>& progress) {
  if (const std::string reason = whyNotOnBullet(scene); !reason.empty())
    return Error{scene.name + ": " + reason + ""};
  Scene native = scene;
  native.stepper.type = StepperType::native;
  CompareReport report;
  const Stopwatch stopwatch;
  const Result<std::vector<ImpulseEvent>> events = sceneEvents(native);
  if (!events) return events.error();
  report.nativeWallTime = stopwatch.seconds();
  const std::vector<ReferenceCollision> nativeCollisions = collisionsOf(*events);
  report.nativeCollisions = nativeCollisions.size();
  const Result<double> nativeLevel = soundLevel(native);
  if (!nativeLevel) return nativeLevel.error();

  for (const double step : steps) {
    const Scene bullet = onBullet(scene, step);
    const Result<BulletRun> run = runBullet(bullet);
    if (!run) return run.error();
    const Result<double> level = soundLevel(bullet);
    if (!level) return level.error();
    CompareRun& result = report.runs.emplace_back();
    result.step = step;
    result.wallTime = run->wallTime;
    compareLocally(*run, result);
    compareGlobally(*run, nativeCollisions, result);
    result.levelDifference = 20.0 * std::log10(*level / *nativeLevel);
    if (progress) {
      progress(static_cast<double>(report.runs.size()) / static_cast<double>(steps.size()));
    }
  }
  return report;
}

}  // namespace carom
