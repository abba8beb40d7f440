// Cost of the native stepper: collisions per second in an elastic gas without gravity, against two
// loops over the same run, an obvious and a fast one; the break of a pool table; memory.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>
#include <malloc.h>

#include "carom/native/recording_format.h"
#include "carom/native/sphere_stepper.h"
#include "tests/bench/cell_yardstick.h"
#include "tests/bench/figures.h"
#include "tests/bench/gas_world.h"
#include "tests/bench/machine_yardstick.h"
#include "tests/bench/scale.h"

namespace carom::bench {
namespace {

// --- The gas -----------------------------------------------------------------------------------

/// A gas that runs on from iteration to iteration, with some fifty collisions in each.
struct FlyingGas {
  explicit FlyingGas(const Gas& gas)
      : stepper(makeStepper(gasWorld(gas))), startEnergy(kineticEnergy(gas.velocities)) {
    while (stepper.counters().collisions < 50) {
      interval = 0.1 * stepper.time() + 1e-4;
      advance();
    }
    const std::uint64_t before = stepper.counters().collisions;
    advance();
    interval *= 50.0 / static_cast<double>(stepper.counters().collisions - before + 1);
  }
  std::span<const ImpulseEvent> advance() { return stepper.advanceTo(stepper.time() + interval); }
  /// Relative error of the energy after so many collisions.
  double energyError(std::uint64_t collisions) {
    while (stepper.counters().collisions < collisions)
      advance();
    return std::abs(stepper.kineticEnergy() / startEnergy - 1.0);
  }

  SphereStepper stepper;
  double startEnergy = 0.0;  ///< J
  double interval = 0.0;     ///< s
};

/// True if both steppers find the same collisions, in the same order and to 1e-9 s. They do for
/// some ten per sphere, until chaos has amplified the rounding.
bool agrees(const Gas& gas, std::size_t collisions) {
  SphereStepper stepper = makeStepper(gasWorld(gas));
  AllPairsGas allPairs(gas);
  std::vector<ImpulseEvent> events;
  for (std::size_t collision = 0; collision < collisions; ++collision) {
    while (events.size() <= 2 * collision) {
      const auto more = stepper.advanceTo(stepper.time() + 1e-3);
      events.insert(events.end(), more.begin(), more.end());
    }
    const AllPairsGas::Collision expected = allPairs.next();
    const ImpulseEvent& event = events[2 * collision];
    if (event.body != expected.sphere || event.other != expected.partner ||
        std::abs(event.time - expected.time) > 1e-9)
      return false;
  }
  return true;
}

Work stepGas(std::shared_ptr<FlyingGas> flying) {
  return [flying = std::move(flying)](benchmark::State& state) {
    const std::uint64_t before = flying->stepper.counters().collisions;
    for ([[maybe_unused]] const auto iteration : state)
      benchmark::DoNotOptimize(flying->advance().data());
    const std::uint64_t collisions = flying->stepper.counters().collisions - before;
    reportRate(state, static_cast<double>(collisions) / static_cast<double>(state.iterations()));
  };
}

Work stepAllPairs(const Gas& gas) {
  const auto allPairs = std::make_shared<AllPairsGas>(gas);
  return [allPairs](benchmark::State& state) {
    for ([[maybe_unused]] const auto iteration : state)
      benchmark::DoNotOptimize(allPairs->next());
    reportRate(state, 1.0);
  };
}

Work stepCells(const Gas& gas) {
  const auto cells = std::make_shared<CellGas>(gas);
  for (int collision = 0; collision < 50; ++collision)  // as far as FlyingGas
    cells->collide();
  return [cells](benchmark::State& state) {
    for ([[maybe_unused]] const auto iteration : state)
      cells->collide();
    benchmark::DoNotOptimize(cells->kineticEnergy());
    reportRate(state, 1.0);
  };
}

Work fail(std::string why) {
  return [why = std::move(why)](benchmark::State& state) { state.SkipWithError(why.c_str()); };
}

std::string text(const char* format, double value, std::size_t count) {
  char buffer[96];
  std::snprintf(buffer, sizeof buffer, format, value, count);
  return buffer;
}

/// Adds the figure; both steppers must find the same `compared` first collisions.
void addAllPairsFigure(Figures& figures, std::size_t count, std::size_t compared) {
  const Gas gas = makeGas(count);
  const bool same = agrees(gas, compared);
  const auto flying = std::make_shared<FlyingGas>(gas);
  figures.add({.name = "gas, N = " + std::to_string(count),
               .unit = "k collisions/s",
               .subject = same ? stepGas(flying) : fail("other collisions than all pairs find"),
               .yardstickName = "all pairs after each collision",
               .yardstick = stepAllPairs(gas),
               .sense = Sense::higherIsBetter,
               .error = text("energy %.0e in 4000; first %zu collisions the same",
                             flying->energyError(4000), compared),
               .scale = 1e-3});
}

void addCellFigure(Figures& figures, std::size_t count, std::size_t collisions) {
  const Gas gas = makeGas(count);
  const auto flying = std::make_shared<FlyingGas>(gas);
  figures.add({.name = "gas, N = " + std::to_string(count),
               .unit = "k collisions/s",
               .subject = stepGas(flying),
               .yardstickName = "minimal cells and heap, periodic",
               .yardstick = stepCells(gas),
               .bar = Bar{Bar::Of::ratio, 1.0},
               .sense = Sense::higherIsBetter,
               .error = text("energy %.0e in %zu", flying->energyError(collisions), collisions),
               .scale = 1e-3});
}

/// CPU time in s per collision, over about so many more.
double collisionTime(FlyingGas& gas, std::uint64_t collisions) {
  const std::uint64_t before = gas.stepper.counters().collisions;
  const std::clock_t start = std::clock();
  while (gas.stepper.counters().collisions < before + collisions)
    benchmark::DoNotOptimize(gas.advance().data());
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC /
         static_cast<double>(gas.stepper.counters().collisions - before);
}
double collisionTime(CellGas& gas, std::uint64_t collisions) {
  const std::clock_t start = std::clock();
  for (std::uint64_t collision = 0; collision < collisions; ++collision)
    gas.collide();
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC /
         static_cast<double>(collisions);
}

/// Measures the time of a collision in `large` over that in `small`, taking turns.
template <class AnyGas>
Work growth(std::shared_ptr<AnyGas> small, std::shared_ptr<AnyGas> large,
            std::uint64_t collisions) {
  return [small = std::move(small), large = std::move(large), collisions](benchmark::State& state) {
    double ratio = 0.0;
    for ([[maybe_unused]] const auto iteration : state) {
      const double one = collisionTime(*small, collisions);
      ratio = collisionTime(*large, collisions) / one;
    }
    reportValue(state, ratio);
  };
}

void addGrowthFigure(Figures& figures, std::size_t few, std::size_t many, const Scale& scale) {
  const auto collisions = scale.of<std::uint64_t>(20'000, 5'000);
  const Gas small = makeGas(few);
  const Gas large = makeGas(many);
  figures.add({.name = "cost, N = " + std::to_string(many) + " / N = " + std::to_string(few),
               .unit = "1",
               .subject = growth(std::make_shared<FlyingGas>(small),
                                 std::make_shared<FlyingGas>(large), collisions),
               .yardstickName = "the same of minimal cells and heap",
               .yardstick = growth(std::make_shared<CellGas>(small),
                                   std::make_shared<CellGas>(large), collisions),
               .bar = Bar{Bar::Of::value, 2.5},
               .sense = Sense::lowerIsBetter});
}

// --- Recording ---------------------------------------------------------------------------------

/// Steps the gas while it is recorded; each iteration makes a new recording.
Work recordGas(std::shared_ptr<FlyingGas> flying) {
  return [flying = std::move(flying)](benchmark::State& state) {
    const std::uint64_t before = flying->stepper.counters().collisions;
    for ([[maybe_unused]] const auto iteration : state) {
      flying->stepper.startRecording();
      for (int part = 0; part < 100; ++part)
        benchmark::DoNotOptimize(flying->advance().data());
      benchmark::DoNotOptimize(flying->stepper.takeRecording());
    }
    const std::uint64_t collisions = flying->stepper.counters().collisions - before;
    reportRate(state, static_cast<double>(collisions) / static_cast<double>(state.iterations()));
  };
}

void addRecordingFigures(Figures& figures, std::size_t count, const Scale& scale) {
  const Gas gas = makeGas(count);
  figures.add({.name = "recorded gas, N = " + std::to_string(count),
               .unit = "k collisions/s",
               .subject = recordGas(std::make_shared<FlyingGas>(gas)),
               .yardstickName = "not recorded",
               .yardstick = stepGas(std::make_shared<FlyingGas>(gas)),
               .sense = Sense::higherIsBetter,
               .scale = 1e-3});
  const auto flying = std::make_shared<FlyingGas>(gas);
  flying->stepper.startRecording();
  const auto collisions = scale.of<std::uint64_t>(100'000, 10'000);
  while (flying->stepper.counters().collisions < collisions)
    flying->advance();
  const auto recording = std::make_shared<Recording>(flying->stepper.takeRecording());
  const auto bytes = std::make_shared<std::vector<std::byte>>(*encoded(*recording));
  figures.add({.name = "recording of 100000 collisions, written",
               .unit = "ms",
               .subject =
                   [recording](benchmark::State& state) {
                     for ([[maybe_unused]] const auto iteration : state)
                       benchmark::DoNotOptimize(encoded(*recording));
                     reportTime(state, 1.0);
                   },
               .yardstickName = kMachine,
               .yardstick = machineTime(),
               .sense = Sense::lowerIsBetter,
               .error = text("%.1f bytes for each of %zu",
                             static_cast<double>(bytes->size()) /
                                 static_cast<double>(recording->collisionCount()),
                             recording->collisionCount()),
               .scale = 1e3});
  figures.add({.name = "the same, read",
               .unit = "ms",
               .subject =
                   [bytes](benchmark::State& state) {
                     for ([[maybe_unused]] const auto iteration : state)
                       benchmark::DoNotOptimize(decoded(*bytes, "bench"));
                     reportTime(state, 1.0);
                   },
               .yardstickName = kMachine,
               .yardstick = machineTime(),
               .sense = Sense::lowerIsBetter,
               .scale = 1e3});
  figures.add({.name = "state at a time, of 100000 collisions",
               .unit = "ns",
               .subject =
                   [recording](benchmark::State& state) {
                     double place = 0.0;  // share of the time, in steps that do not soon repeat
                     const double length = recording->end() - recording->begin();
                     for ([[maybe_unused]] const auto iteration : state) {
                       place += 0.6180339887498949;
                       place -= std::floor(place);
                       benchmark::DoNotOptimize(
                           recording->state(7, recording->begin() + place * length));
                     }
                     reportTime(state, 1.0);
                   },
               .yardstickName = kMachine,
               .yardstick = machineTime(),
               .sense = Sense::lowerIsBetter,
               .scale = 1e9});
}

// --- The break ---------------------------------------------------------------------------------

constexpr double kBall = 0.028575;  // m, radius of a pool ball
constexpr std::size_t kBreakCollisions = 87;

/// Nine balls in a diamond, 0.1 mm apart, and a cue ball at 8 m/s between four cushions: no
/// friction, no gravity.
SphereWorld nineBallBreak() {
  constexpr std::array<int, 5> kRows = {1, 2, 3, 2, 1};
  const double pitch = 2.0 * kBall + 1e-4;
  SphereWorld world;
  const auto place = [&](const Vec3& position, const Vec3& velocity) {
    const auto id = static_cast<BodyId>(world.spheres.size());
    world.spheres.push_back({id, kBall, 0.17, 0.95, position, velocity});
  };
  place({-0.635, 0.0, 0.004}, {8.0, 0.0, 0.0});
  for (std::size_t row = 0; row < kRows.size(); ++row) {
    const double x = 0.635 + static_cast<double>(row) * 0.5 * std::sqrt(3.0) * pitch;
    for (int ball = 0; ball < kRows[row]; ++ball)
      place({x, 0.0, pitch * (ball - 0.5 * (kRows[row] - 1))}, Vec3::Zero());
  }
  world.planes = {{100, Vec3::UnitX(), -1.27, 0.6},
                  {101, -Vec3::UnitX(), -1.27, 0.6},
                  {102, Vec3::UnitZ(), -0.635, 0.6},
                  {103, -Vec3::UnitZ(), -0.635, 0.6}};
  return world;
}

/// Time in s of the last of the first kBreakCollisions; none if there are fewer.
std::optional<double> endOfBreak() {
  SphereStepper stepper = makeStepper(nineBallBreak());
  const auto events = stepper.advanceTo(60.0);
  if (events.size() < 2 * kBreakCollisions) return std::nullopt;
  return events[2 * kBreakCollisions - 1].time;
}

Work playBreak() {
  const std::optional<double> end = endOfBreak();
  if (!end) return fail("the balls lie still after less than 87 collisions");
  return [end = *end](benchmark::State& state) {
    const SphereWorld world = nineBallBreak();
    for ([[maybe_unused]] const auto iteration : state) {
      SphereStepper stepper = makeStepper(world);
      benchmark::DoNotOptimize(stepper.advanceTo(end).data());
    }
    reportTime(state, 1.0);
  };
}

void addBreakFigure(Figures& figures) {
  figures.add({.name = "nine-ball break, 87 collisions",
               .unit = "ms",
               .subject = playBreak(),
               .yardstickName = kMachine,
               .yardstick = machineTime(),
               .bar = Bar{Bar::Of::value, 0.5},
               .sense = Sense::lowerIsBetter,
               .scale = 1e3});
}

// --- Memory ------------------------------------------------------------------------------------

/// Bytes that the heap has allocated.
std::size_t heapBytes() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

void weighStepper(benchmark::State& state, std::size_t count) {
  const SphereWorld world = gasWorld(makeGas(count));
  double perSphere = 0.0;
  for ([[maybe_unused]] const auto iteration : state) {
    const std::size_t before = heapBytes();
    SphereStepper stepper = makeStepper(world);
    for (int step = 1; step <= 10; ++step)  // for a while, in small batches of events
      benchmark::DoNotOptimize(stepper.advanceTo(1e-4 * step).data());
    perSphere = static_cast<double>(heapBytes() - before) / static_cast<double>(count);
  }
  reportValue(state, perSphere);
}

void addMemoryFigure(Figures& figures, std::size_t count) {
  figures.add(
      besideItsBar({.name = "memory, N = " + std::to_string(count),
                    .unit = "kB per sphere",
                    .subject = [count](benchmark::State& state) { weighStepper(state, count); },
                    .bar = Bar{Bar::Of::value, 0.3},
                    .sense = Sense::lowerIsBetter,
                    .scale = 1e-3}));
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  const carom::bench::Scale scale = carom::bench::scaleOf(argc, argv);
  carom::bench::Figures figures;
  carom::bench::addAllPairsFigure(figures, 64, 256);
  carom::bench::addAllPairsFigure(figures, 512, 512);
  carom::bench::addAllPairsFigure(figures, 4096, 5);
  carom::bench::addCellFigure(figures, 100, 4000);
  carom::bench::addCellFigure(figures, 1000, 4000);
  carom::bench::addCellFigure(figures, 10000, 1000);
  carom::bench::addCellFigure(figures, 100000, 1000);
  carom::bench::addGrowthFigure(figures, 1000, 100000, scale);
  carom::bench::addRecordingFigures(figures, 1000, scale);
  carom::bench::addBreakFigure(figures);
  carom::bench::addMemoryFigure(figures, 100000);
  return figures.run(argc, argv);
}
