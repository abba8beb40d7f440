// Cost of the plugin: rendering block by block, and a step of Bullet with sound beside one without.

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
#include "scenes/format/scene_loader.h"
#include "scenes/run/bullet_scene.h"
#include "tests/bench/figures.h"
#include "tests/bench/machine_yardstick.h"
#include "tests/bench/scale.h"
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
    render(kBlock);  // starts the clock
  }

  /// Makes a step of the simulation and renders as many samples.
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
  /// A marble of one of twenty sizes from 3 to 12 mm.
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

/// Costs of blocks, as shares of a block's own duration.
struct BlockCosts {
  std::vector<double> byClock;
  std::vector<double> byCpu;
  std::size_t allocations = 0;

  explicit BlockCosts(std::size_t blocks) {
    byClock.reserve(blocks);
    byCpu.reserve(blocks);
  }

  template <class Work>
  void measure(Work work) {
    constexpr double kDuration = static_cast<double>(kBlock) / kRate;
    const double clock = seconds(CLOCK_MONOTONIC);
    const double cpu = seconds(CLOCK_THREAD_CPUTIME_ID);
    const test::NoAllocScope scope;
    work();
    allocations += scope.allocations();
    byCpu.push_back((seconds(CLOCK_THREAD_CPUTIME_ID) - cpu) / kDuration);
    byClock.push_back((seconds(CLOCK_MONOTONIC) - clock) / kDuration);
  }
};

/// Measures a minute of traffic (less with --short), and as many passes of the machine yardstick.
class BlockRun {
 public:
  explicit BlockRun(const Scale& scale) : duration_(scale.of(60.0, 2.0)) {}

  /// The costs, measured at the first call.
  const BlockCosts& ours() {
    if (!ours_) measure();
    return *ours_;
  }
  const BlockCosts& yardstick() {
    if (!yardstick_) measureYardstick();
    return *yardstick_;
  }
  /// Number of events that were left out, cut or late.
  double faults() {
    ours();
    return static_cast<double>(heard_.late + heard_.overBudget + heard_.stolen + heard_.noBus +
                               heard_.tooLong + heard_.queueFaults + heard_.skipped);
  }

 private:
  std::size_t blocks() const { return static_cast<std::size_t>(duration_ * kRate / kBlock) + 1; }

  void measure() {
    Traffic traffic(1000.0);
    ours_.emplace(blocks());
    for (double time = 0.0; time < duration_; time += kStep)
      traffic.step([&](auto render) { ours_->measure(render); });
    heard_ = traffic.statistics();
  }
  void measureYardstick() {
    MachineWork machine;
    yardstick_.emplace(blocks());
    for (std::size_t block = 0; block < blocks(); ++block)
      yardstick_->measure([&] { benchmark::DoNotOptimize(machine.pass()); });
  }

  double duration_;  // s
  std::optional<BlockCosts> ours_;
  std::optional<BlockCosts> yardstick_;
  SoundStatistics heard_;
};

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
Work once(std::function<double()> value) {
  return [value = std::move(value)](benchmark::State& state) {
    double measured = 0.0;
    for ([[maybe_unused]] const auto iteration : state)
      measured = value();
    reportValue(state, measured);
  };
}

using ValueOf = std::function<double(const BlockCosts&)>;

void addCost(Figures& figures, const std::shared_ptr<BlockRun>& run, Figure figure,
             const ValueOf& value) {
  figure.unit = "% of the block";
  figure.subject = once([=] { return value(run->ours()); });
  figure.yardstickName = std::string(kMachine) + ", likewise";
  figure.yardstick = once([=] { return value(run->yardstick()); });
  figure.sense = Sense::lowerIsBetter;
  figure.scale = 100.0;
  figures.add(std::move(figure));
}

void addCount(Figures& figures, const std::string& name, std::function<double()> count) {
  figures.add(besideItsBar({.name = name,
                            .unit = "",
                            .subject = once(std::move(count)),
                            .bar = Bar{Bar::Of::value, 0.0},
                            .sense = Sense::lowerIsBetter}));
}

/// Noise of the worst block: it may catch a pause of several blocks that the machine causes.
constexpr double kPause = 1000.0;  // % of the block

void addBlocks(Figures& figures, const Scale& scale) {
  const auto run = std::make_shared<BlockRun>(scale);
  addCost(figures, run,
          {.name = "worst of a minute's blocks, by the clock",
           .bar = Bar{Bar::Of::value, 20.0},
           .error = "45,000 blocks of 64 frames, 1000 collisions/s, a pair of microphones",
           .noise = kPause},
          [](const BlockCosts& costs) { return worst(costs.byClock); });
  addCost(figures, run,
          {.name = "the same, CPU time", .bar = Bar{Bar::Of::value, 20.0}, .noise = 0.1 * kPause},
          [](const BlockCosts& costs) { return worst(costs.byCpu); });
  addCost(figures, run, {.name = "their mean, CPU time"},
          [](const BlockCosts& costs) { return mean(costs.byCpu); });
  addCount(figures, "allocations in them",
           [run] { return static_cast<double>(run->ours().allocations); });
  addCount(figures, "of their 120,000 events, left out or late", [run] { return run->faults(); });
}

/// The bridge benchmark's scene, for a longer time.
Scene fallingBalls(const Scale& scale) {
  Result<Scene> scene = thousandBalls(scale.of(0.5, 0.1));
  if (!scene) std::abort();
  return *std::move(scene);
}

enum class Attached { nothing, bridge, sound };

/// A running Bullet world, with a bridge, with sound or with neither.
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
    settings.listeners = {SoundSettings::defaultListener()};
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
  double inRender_ = 0.0;  // s of CPU time
};

struct Overhead {
  double bridge = 0.0;  // fraction of Bullet's own step, as are the next two
  double step = 0.0;
  double render = 0.0;
  double perStep = 0.0;  // ms, duration of Bullet's own step
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

/// Describes the traffic that was measured.
std::string traffic(const Scene& scene) {
  const Overhead once = overheadOf(scene);
  char text[96];
  std::snprintf(text, sizeof text, "%.1f events in a step of %.2f ms", once.events, once.perStep);
  return text;
}

void addOverhead(Figures& figures, const Scale& scale) {
  const Scene scene = fallingBalls(scale);
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
                 .yardstickName = "Bullet's step",
                 .fixedYardstick = 100.0,
                 .bar = bar,
                 .sense = Sense::lowerIsBetter,
                 .error = underWay,
                 .scale = 100.0,
                 .noise = scale.of(3.0, 25.0)});
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
  const Scale scale = scaleOf(argc, argv);
  addBlocks(figures, scale);
  addOverhead(figures, scale);
  return figures.run(argc, argv);
}
