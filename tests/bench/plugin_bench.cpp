// What the plugin costs: rendering block by block, and a step of Bullet with sound beside one
// without.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include "carom/audio/material.h"
#include "carom/bullet/bullet_bridge.h"
#include "carom/event_sound.h"
#include "carom/sound.h"
#include "scenes/bullet_scene.h"
#include "scenes/scene_loader.h"
#include "tests/bench/figures.h"
#include "tests/bench/thousand_balls.h"
#include "tests/support/no_alloc_scope.h"
#include "tests/support/random.h"

namespace carom::bench {

using namespace scenes;

namespace {

constexpr double kRate = 48000.0;      // Hz
constexpr double kStep = 1.0 / 240.0;  // s
constexpr std::size_t kStepFrames = 200;
constexpr std::size_t kBlock = 64;  // frames

double seconds(clockid_t clock) {
  std::timespec time{};
  clock_gettime(clock, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Marbles that hit each other in a space of 2 m, heard by a pair of microphones in its middle.
class Traffic {
 public:
  static constexpr BodyId kMarbles = 100;

  explicit Traffic(double perSecond) : perSecond_(perSecond), sound_(makeSound()) {
    for (BodyId id = 0; id < kMarbles; ++id)
      if (!sound_.setBody(id, marble(id))) std::abort();
    if (!sound_.prepareRendering(kRate)) std::abort();
    render(kBlock);  // the clock begins
  }

  /// A step of the simulation, and as many samples.
  template <class Measure>
  void step(Measure measure) {
    time_ += kStep;
    for (collisions_ += perSecond_ * kStep; collisions_ >= 1.0; collisions_ -= 1.0)
      collide();
    sound_.advanceTo(time_);
    for (owed_ += kStepFrames; owed_ >= kBlock; owed_ -= kBlock)
      measure([this] { render(kBlock); });
  }
  SoundStatistics statistics() const { return sound_.statistics(); }

 private:
  static EventSound makeSound() {
    SoundSettings settings;
    settings.limiter.emplace();
    settings.fullScale = 2.0;
    Result<EventSound> sound = EventSound::create(settings);
    if (!sound) std::abort();
    return *std::move(sound);
  }
  /// Of twenty sizes from 3 to 12 mm.
  static SoundBody marble(BodyId id) {
    const double radius = 0.003 * std::pow(4.0, (id % 20) / 19.0);
    const Material glass = *findMaterial("glass");
    return {.material = glass,
            .mass = 4.0 / 3.0 * 3.141592653589793 * glass.density * std::pow(radius, 3),
            .radius = radius};
  }
  void collide() {
    const auto first = static_cast<BodyId>(random_.below(kMarbles));
    const auto second = static_cast<BodyId>(
        (first + 1 + static_cast<BodyId>(random_.below(kMarbles - 1))) % kMarbles);
    const SoundBody a = marble(first);
    const SoundBody b = marble(second);
    ImpulseEvent event;
    event.time = time_ - random_.between(0.0, 2.0 * kStep);
    event.normal = random_.direction();
    event.approachSpeed = random_.logBetween(0.1, 3.0);
    event.effectiveMass = 1.0 / (1.0 / a.mass + 1.0 / b.mass);
    event.impulse = 1.8 * event.effectiveMass * event.approachSpeed * event.normal;
    event.position = random_.inCube();
    event.body = first;
    event.other = second;
    event.radius = a.radius;
    event.otherRadius = b.radius;
    event.bodyPosition = event.position + a.radius * event.normal;
    sound_.post(event);
    std::swap(event.body, event.other);
    std::swap(event.radius, event.otherRadius);
    event.impulse = -event.impulse;
    event.normal = -event.normal;
    event.bodyPosition = event.position + b.radius * event.normal;
    sound_.post(event);
  }
  void render(std::size_t frames) { sound_.renderInterleaved(block_.data(), frames); }

  double perSecond_;
  EventSound sound_;
  Random random_{1};
  std::vector<float> block_ = std::vector<float>(2 * kBlock);
  double time_ = 0.0;
  double collisions_ = 0.0;
  std::size_t owed_ = 0;
};

/// Shares of a block's own duration.
struct BlockCosts {
  std::vector<double> byClock;
  std::vector<double> byCpu;
  std::size_t allocations = 0;
  SoundStatistics statistics;
};

/// A minute of it.
const BlockCosts& blockCosts() {
  static const BlockCosts costs = [] {
    BlockCosts made;
    Traffic traffic(1000.0);
    const double duration = static_cast<double>(kBlock) / kRate;
    made.byClock.reserve(50000);
    made.byCpu.reserve(50000);
    const auto steps = static_cast<int>(60.0 / kStep);
    for (int step = 0; step < steps; ++step) {
      traffic.step([&](auto render) {
        const double clock = seconds(CLOCK_MONOTONIC);
        const double cpu = seconds(CLOCK_THREAD_CPUTIME_ID);
        const test::NoAllocScope scope;
        render();
        made.allocations += scope.allocations();
        made.byCpu.push_back((seconds(CLOCK_THREAD_CPUTIME_ID) - cpu) / duration);
        made.byClock.push_back((seconds(CLOCK_MONOTONIC) - clock) / duration);
      });
    }
    made.statistics = traffic.statistics();
    return made;
  }();
  return costs;
}

double worst(const std::vector<double>& shares) {
  return *std::ranges::max_element(shares);
}

double mean(const std::vector<double>& shares) {
  double sum = 0.0;
  for (const double share : shares)
    sum += share;
  return sum / static_cast<double>(shares.size());
}

/// A value that is measured once, if it is asked for.
void addValue(Figures& figures, Figure figure, std::function<double()> value) {
  figure.subject = [value = std::move(value)](benchmark::State& state) {
    double measured = 0.0;
    for ([[maybe_unused]] const auto iteration : state)
      measured = value();
    reportValue(state, measured);
  };
  figure.sense = Sense::lowerIsBetter;
  figures.add(std::move(figure));
}

/// Events that were not heard as they should be.
double faults() {
  const SoundStatistics& s = blockCosts().statistics;
  return static_cast<double>(s.late + s.overBudget + s.stolen + s.noBus + s.tooLong +
                             s.queueFaults + s.skipped);
}

void addBlocks(Figures& figures) {
  addValue(figures,
           {.name = "worst of a minute's blocks, by the clock",
            .unit = "% of the block",
            .bar = Bar{Bar::Of::value, 20.0},
            .error = "45,000 blocks of 64 frames, 1000 collisions/s, a pair of microphones",
            .scale = 100.0},
           [] { return worst(blockCosts().byClock); });
  addValue(figures,
           {.name = "the same, CPU time",
            .unit = "% of the block",
            .bar = Bar{Bar::Of::value, 20.0},
            .scale = 100.0},
           [] { return worst(blockCosts().byCpu); });
  addValue(figures, {.name = "their mean, CPU time", .unit = "% of the block", .scale = 100.0},
           [] { return mean(blockCosts().byCpu); });
  addValue(figures, {.name = "allocations in them", .unit = "", .bar = Bar{Bar::Of::value, 0.0}},
           [] { return static_cast<double>(blockCosts().allocations); });
  addValue(figures,
           {.name = "of their 120,000 events, left out or late",
            .unit = "",
            .bar = Bar{Bar::Of::value, 0.0}},
           faults);
}

/// The bridge's own scene, for longer.
Scene fallingBalls() {
  Result<Scene> scene = thousandBalls(0.5);
  if (!scene) std::abort();
  return *std::move(scene);
}

enum class Attached { nothing, bridge, sound };

/// A Bullet world under way, with or without.
class Run {
 public:
  Run(const Scene& scene, Attached attached) : world_(scene) {
    if (attached == Attached::bridge) {
      Result<BulletBridge> bridge =
          BulletBridge::attach(world_.world(), {.delivery = EventDelivery::prompt});
      if (!bridge) std::abort();
      bridge_.emplace(*std::move(bridge));
    }
    if (attached == Attached::sound) attach();
  }

  void step() {
    const double start = seconds(CLOCK_THREAD_CPUTIME_ID);
    world_.world().stepSimulation(static_cast<btScalar>(kStep), 0);
    if (bridge_) bridge_->clear();
    const double stepped = seconds(CLOCK_THREAD_CPUTIME_ID);
    if (sound_) sound_->renderInterleaved(block_.data(), kStepFrames);
    inStep_ += stepped - start;
    inRender_ += seconds(CLOCK_THREAD_CPUTIME_ID) - stepped;
  }
  void forget() { inStep_ = inRender_ = 0.0; }
  double inStep() const { return inStep_; }
  double inRender() const { return inRender_; }
  double events() const { return static_cast<double>(sound_->statistics().events); }

 private:
  void attach() {
    SoundSettings settings;
    settings.listeners.front().position = {0.0, 2.0, 2.0};
    settings.limiter.emplace();
    Result<Sound> sound = Sound::attach(world_.world(), settings);
    if (!sound || !sound->prepareRendering(kRate)) std::abort();
    sound_.emplace(*std::move(sound));
    sound_->renderInterleaved(block_.data(), kStepFrames);
  }

  BulletScene world_;
  std::optional<BulletBridge> bridge_;
  std::optional<Sound> sound_;
  std::vector<float> block_ = std::vector<float>(2 * kStepFrames);
  double inStep_ = 0.0;    // s of CPU time
  double inRender_ = 0.0;  // likewise
};

struct Overhead {
  double bridge = 0.0;  // all of Bullet's own step
  double step = 0.0;
  double render = 0.0;
  double perStep = 0.0;  // ms, Bullet's own
  double events = 0.0;   // per step
};

Overhead overheadOf(const Scene& scene) {
  Run plain(scene, Attached::nothing);
  Run bridged(scene, Attached::bridge);
  Run sounding(scene, Attached::sound);
  const auto steps = static_cast<int>(std::lround(scene.duration / kStep));
  constexpr int kWarmUp = 4;
  for (int step = 0; step < steps; ++step) {
    if (step == kWarmUp)
      for (Run* run : {&plain, &bridged, &sounding})
        run->forget();
    Run* order[] = {&plain, &bridged, &sounding};
    std::rotate(order, order + step % 3, order + 3);
    for (Run* run : order)
      run->step();
  }
  return {(bridged.inStep() - plain.inStep()) / plain.inStep(),
          (sounding.inStep() - plain.inStep()) / plain.inStep(),
          sounding.inRender() / plain.inStep(), 1e3 * plain.inStep() / (steps - kWarmUp),
          sounding.events() / steps};
}

/// What was under way.
std::string traffic(const Scene& scene) {
  const Overhead once = overheadOf(scene);
  char text[96];
  std::snprintf(text, sizeof text, "%.1f events in a step of %.2f ms", once.events, once.perStep);
  return text;
}

void addOverhead(Figures& figures) {
  const Scene scene = fallingBalls();
  const std::string underWay = traffic(scene);
  const auto add = [&](const std::string& name, std::optional<Bar> bar, auto part) {
    figures.add({.name = name,
                 .unit = "% of Bullet's step",
                 .subject =
                     [scene, part](benchmark::State& state) {
                       double share = 0.0;
                       for ([[maybe_unused]] const auto iteration : state)
                         share = part(overheadOf(scene));
                       reportValue(state, share);
                     },
                 .bar = bar,
                 .sense = Sense::lowerIsBetter,
                 .error = underWay,
                 .scale = 100.0});
  };
  add("1000 balls, whole plugin", Bar{Bar::Of::value, 8.0},
      [](const Overhead& o) { return o.step + o.render; });
  add("1000 balls, in the step", std::nullopt, [](const Overhead& o) { return o.step; });
  add("1000 balls, of that the bridge", std::nullopt, [](const Overhead& o) { return o.bridge; });
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  using namespace carom::bench;
  Figures figures;
  addBlocks(figures);
  addOverhead(figures);
  return figures.run(argc, argv);
}
