// Cost of a jello: steps per second of the classic Runge-Kutta method, by size, beside the same
// lattice in structs and pointers.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <sstream>
#include <string>

#include <benchmark/benchmark.h>

#include "native/jello/jello_stepper.h"
#include "tests/bench/figures.h"
#include "tests/bench/pointer_jello.h"

namespace carom::bench {

using namespace native;

namespace {

constexpr double kStep = 5e-4;  // s

/// A cube of 1 m and 1 kg with `count` points along an edge that swings a little, damped.
JelloWorld swinging(std::size_t count) {
  JelloWorld world;
  world.lattice.count = count;
  world.lattice.pointMass = 1.0 / static_cast<double>(world.pointCount());
  // The material stays the same: a spring's stiffness is proportional to its length.
  world.lattice.stiffness = 200.0 * 7.0 / static_cast<double>(count - 1);
  world.lattice.damping = 0.02;
  world.positions = restingPoints(world.lattice, Vec3::Zero());
  for (Vec3& point : world.positions) {
    world.velocities.emplace_back(0.1 * std::sin(3.0 * point.y()), 0.0, 0.2 * point.x());
    point *= 1.05;
  }
  return world;
}

double stepOf(std::size_t count) {
  return kStep * 8.0 / static_cast<double>(count);
}

JelloStepper stepperOf(std::size_t count) {
  Result<JelloStepper> stepper =
      JelloStepper::create(swinging(count), JelloIntegrator::rungeKutta4, stepOf(count));
  if (!stepper) std::abort();
  return *std::move(stepper);
}

Work stepping(std::size_t count) {
  return [=](benchmark::State& state) {
    JelloStepper stepper = stepperOf(count);
    for (auto _ : state)
      if (!stepper.advance()) std::abort();
    reportRate(state, 1.0);
  };
}

Work pointing(std::size_t count) {
  return [=](benchmark::State& state) {
    PointerJello jello(swinging(count));
    for (auto _ : state)
      jello.step(stepOf(count));
    benchmark::DoNotOptimize(jello.position(0));
    reportRate(state, 1.0);
  };
}

/// Distance in m between the two after a hundred steps.
std::string apart(std::size_t count) {
  JelloStepper stepper = stepperOf(count);
  PointerJello jello(swinging(count));
  double farthest = 0.0;
  for (int step = 0; step < 100; ++step) {
    if (!stepper.advance()) std::abort();
    jello.step(stepOf(count));
  }
  for (std::size_t point = 0; point < stepper.world().pointCount(); ++point)
    farthest = std::max(farthest, (stepper.position(point) - jello.position(point)).norm());
  std::ostringstream text;
  text << farthest << " m";
  return text.str();
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  using namespace carom::bench;
  Figures figures;
  for (const std::size_t count : {8U, 16U, 32U, 64U}) {
    const std::string size = std::to_string(count) + "^3 points";
    figures.add({.name = "steps of " + size,
                 .unit = "1/s",
                 .subject = stepping(count),
                 .yardstickName = "structs and pointers",
                 .yardstick = pointing(count),
                 .bar = count == 8 ? std::optional(Bar{Bar::Of::ratio, 8.0}) : std::nullopt,
                 .error = count <= 16 ? apart(count) : ""});
  }
  figures.add({.name = "8^3 points at 0.5 ms",
               .unit = "times real time",
               .subject = stepping(8),
               .yardstickName = "structs and pointers",
               .yardstick = pointing(8),
               .bar = Bar{Bar::Of::value, 20.0},
               .scale = kStep});
  return figures.run(argc, argv);
}
