// Accuracy of the native stepper over long runs: a table of its results beside published values and
// closed forms.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <numbers>
#include <string>

#include "tests/bench/gas_world.h"
#include "tests/bench/table_program.h"
#include "tests/support/random.h"

namespace carom::bench {
namespace {

constexpr char kHelp[] =
    R"(usage: bench_native_accuracy [--short]
       ./bench native_accuracy [--short]

How exact the native stepper is over long runs. With --short they are shorter and smaller, so that
the mean free time misses its bar by chance.
)";

void print(const char* what, double found, double expected, double error, double bar) {
  std::printf("%-46s %14.8g %14.8g %10.1e %10.0e  %s\n", what, found, expected, error, bar,
              error <= bar ? "" : "falls short");
}

/// Elastic spheres of 1 kg and 1 m diameter between six walls; they fill `fraction` of the volume.
struct BoxedGas {
  double side = 0.0;  ///< m
  SphereWorld world;

  BoxedGas(std::size_t count, double fraction) {
    const Gas gas = makeGas(count);
    const double spread = std::cbrt(0.3 / fraction);
    side = spread * gas.side;
    world = gasWorld(gas, spread);
  }
};

// ---- Mean free time

/// Collisions per sphere and second by Enskog's theory for spheres of 1 kg and 1 m diameter: 4
/// sqrt(pi) n sigma^2 g sqrt(kT / m), with g at contact after Carnahan and Starling (1969, J. Chem.
/// Phys. 51, 635).
double enskogRate(double density, double temperature) {
  const double fraction = density * std::numbers::pi / 6.0;
  const double contact = (1.0 - 0.5 * fraction) / std::pow(1.0 - fraction, 3);
  return 4.0 * std::sqrt(std::numbers::pi * temperature) * density * contact;
}

/// Weight of a place in the statistics. Walls gather spheres in layers next to them; therefore
/// nothing counts within 2 diameters of a wall, everything in the middle, and between them the
/// weight changes smoothly, because at a sharp border the presence of a layer would matter.
struct Window {
  double side = 0.0;
  double weight(const Vec3& position) const {
    double product = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
      const double place = (position[axis] - kMargin) / (side - 2.0 * kMargin);
      if (!(place > 0.0 && place < 1.0)) return 0.0;
      const double sine = std::sin(std::numbers::pi * place);
      product *= sine * sine;
    }
    return product;
  }
  double volume() const { return std::pow(0.5 * (side - 2.0 * kMargin), 3); }  ///< m^3, weighted
  static constexpr double kMargin = 2.0;                                       ///< m
};

/// Prints the mean free time in the window against the theory for the density and temperature
/// there.
void printMeanFreeTime(double fraction, const Scale& scale) {
  const std::size_t count = scale.of<std::size_t>(4096, 512);
  const int samples = scale.of(4800, 100);
  const BoxedGas gas(count, fraction);
  const Window window{gas.side};
  SphereStepper stepper = makeStepper(gas.world);
  const double rate = enskogRate(fraction * 6.0 / std::numbers::pi,
                                 stepper.kineticEnergy() / (1.5 * static_cast<double>(count)));
  stepper.advanceTo(scale.of(500.0, 10.0) / rate);  // the lattice and its sound waves are forgotten
  const double interval = 0.25 / rate;
  double collisions = 0.0;  // between two spheres
  double present = 0.0;
  double squares = 0.0;  // (m/s)^2, sum over the velocities
  for (int sample = 0; sample < samples; ++sample) {
    for (const ImpulseEvent& event : stepper.advanceTo(stepper.time() + interval)) {
      if (event.body < count && event.other < count)
        collisions += window.weight(event.bodyPosition);
    }
    for (std::size_t sphere = 0; sphere < count; ++sphere) {
      const SphereState state = stepper.state(sphere);
      const double weight = window.weight(state.position);
      present += weight;
      squares += weight * state.velocity.squaredNorm();
    }
  }
  const double found = present * interval / collisions;
  const double expected =
      1.0 / enskogRate(present / samples / window.volume(), squares / (3.0 * present));
  char what[64];
  std::snprintf(what, sizeof what, "mean free time, s, %.0f %% of the volume", 100.0 * fraction);
  print(what, found, expected, std::abs(found / expected - 1.0), 0.01);
}

// ---- Drift

void printEnergyDrift(const Scale& scale) {
  const auto collisions = scale.of<std::uint64_t>(1'000'000, 20'000);
  const BoxedGas gas(1000, 0.3);
  SphereStepper stepper = makeStepper(gas.world);
  const double start = stepper.kineticEnergy();
  while (stepper.counters().collisions < collisions)
    stepper.advanceTo(stepper.time() + 0.1);
  const double energy = stepper.kineticEnergy();
  print(scale.of("energy after 10^6 collisions, J", "energy after 20,000 collisions, J"), energy,
        start, std::abs(energy / start - 1.0), 1e-12);
}

/// One ball that bounces for ever between the same bodies, first at `first` and then every
/// `interval` (s).
struct Bouncing {
  const char* where = "";
  SphereWorld world;
  long double first = 0.0L;
  long double interval = 0.0L;
};

/// Prints the time of the last of so many collisions, and the worst error of all.
void printTimeDrift(const Bouncing& ball, std::uint64_t collisions) {
  SphereStepper stepper = makeStepper(ball.world);
  double last = 0.0;
  long double worst = 0.0L;
  std::uint64_t number = 0;
  while (number < collisions) {
    for (const ImpulseEvent& event :
         stepper.advanceTo(stepper.time() + 1000.0 * static_cast<double>(ball.interval))) {
      if (event.body != 0 || number == collisions) continue;
      last = event.time;
      const long double expected = ball.first + static_cast<long double>(number++) * ball.interval;
      worst = std::max(worst, std::abs(last - expected) / std::max(expected, 1.0L));
    }
  }
  const long double end = ball.first + static_cast<long double>(collisions - 1) * ball.interval;
  char what[64];
  std::snprintf(what, sizeof what, "time after %.0e bounces %s, s", static_cast<double>(collisions),
                ball.where);
  print(what, last, static_cast<double>(end), static_cast<double>(worst), 1e-14);
}

Sphere ball(const Vec3& position, const Vec3& velocity) {
  return {0, 0.25, 1.0, 1.0, position, velocity};
}

void printTimeDrifts(const Scale& scale) {
  const auto collisions = scale.of<std::uint64_t>(10'000'000, 200'000);
  SphereWorld corridor;
  corridor.restSpeed = 0.0;
  corridor.spheres = {ball(Vec3(0.5, 0.0, 0.0), Vec3(0.7, 0.0, 0.0))};
  corridor.planes = {{1, Vec3::UnitX(), 0.0, 1.0}, {2, -Vec3::UnitX(), -1.1, 1.0}};
  const auto speed = static_cast<long double>(0.7);
  const auto wide = static_cast<long double>(1.1);
  printTimeDrift({"between two walls", corridor, (wide - 0.75L) / speed, (wide - 0.5L) / speed},
                 collisions);
  SphereWorld floor;
  floor.gravity = {0.0, -9.81, 0.0};
  floor.spheres = {ball(Vec3(0.0, 0.35, 0.0), Vec3::Zero())};
  floor.planes = {{1, Vec3::UnitY(), 0.0, 1.0}};
  const long double height = static_cast<long double>(0.35) - 0.25L;
  const long double fall = std::sqrt(2.0L * height / static_cast<long double>(9.81));
  printTimeDrift({"on a floor", floor, fall, 2.0L * fall}, collisions);
}

// ---- A pile

/// `count` spheres of 4 to 10 mm, e = 0.5, in layers that fall into a box of 20 cm by 20 cm.
SphereWorld pouredSpheres(std::size_t count) {
  constexpr double kHalf = 0.1;       // m, of the box
  constexpr std::size_t kPerRow = 9;  // spheres in a row, in layers of 9 by 9
  constexpr double kRestitution = 0.5;
  Random random(3);
  SphereWorld world;
  world.gravity = {0.0, -9.81, 0.0};
  const double pitch = 2.0 * kHalf / kPerRow;
  for (std::size_t number = 0; number < count; ++number) {
    Sphere sphere;
    sphere.id = static_cast<BodyId>(number);
    sphere.radius = random.between(0.004, 0.01);
    sphere.mass = 2500.0 * 4.0 / 3.0 * std::numbers::pi * std::pow(sphere.radius, 3);
    sphere.restitution = kRestitution;
    const std::size_t row = number / kPerRow;
    const std::size_t layer = row / kPerRow;
    sphere.position = {-kHalf + (static_cast<double>(number % kPerRow) + 0.5) * pitch,
                       0.02 + static_cast<double>(layer) * 1.05 * pitch,
                       -kHalf + (static_cast<double>(row % kPerRow) + 0.5) * pitch};
    for (double& component : sphere.velocity)
      component = random.between(-0.3, 0.3);
    world.spheres.push_back(sphere);
  }
  const auto wall = [&](const Vec3& normal, double offset) {
    world.planes.push_back(
        {static_cast<BodyId>(count + world.planes.size()), normal, offset, kRestitution});
  };
  wall(Vec3::UnitY(), 0.0);
  for (const double side : {1.0, -1.0}) {
    wall(side * Vec3::UnitX(), -kHalf);
    wall(side * Vec3::UnitZ(), -kHalf);
  }
  return world;
}

void printPile(const Scale& scale) {
  const auto count = scale.of<std::size_t>(1000, 200);
  SphereStepper stepper = makeStepper(pouredSpheres(count));
  const auto energyNow = [&] { return stepper.kineticEnergy() + stepper.potentialEnergy(); };
  const double start = energyNow();
  double before = start;
  double gained = 0.0;
  bool valid = true;
  const std::clock_t begin = std::clock();
  for (int step = 1; step <= 40; ++step) {
    stepper.advanceTo(0.05 * step);
    gained = std::max(gained, energyNow() - before);
    before = energyNow();
    valid = valid && static_cast<bool>(stepper.validate());
  }
  const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  const SphereStepperCounters& counters = stepper.counters();
  print((std::to_string(count) + " poured spheres, after 2 s: energy of motion, J").c_str(),
        stepper.kineticEnergy(), 0.0, stepper.kineticEnergy() / (start - before), 1e-6);
  print("  most energy gained in any 50 ms, J", gained, 0.0, gained / (start - before), 1e-6);
  print("  not valid", valid ? 0.0 : 1.0, 0.0, valid ? 0.0 : 1.0, 0.0);
  std::printf(
      "  %.0f s of one core; %.2f million contacts reported, %.2f million of rest; %llu laid "
      "down, %llu woken\n",
      seconds, 1e-6 * static_cast<double>(counters.collisions),
      1e-6 * static_cast<double>(counters.restContacts),
      static_cast<unsigned long long>(counters.putToSleep),
      static_cast<unsigned long long>(counters.woken));
}

int run(const Scale& scale) {
  std::printf("%-46s %14s %14s %10s %10s\n", "", "found", "expected", "error", "bar");
  for (const double fraction : {0.1, 0.2, 0.3, 0.4})
    printMeanFreeTime(fraction, scale);
  printEnergyDrift(scale);
  printTimeDrifts(scale);
  printPile(scale);
  return 0;
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  return carom::bench::TableProgram{"bench_native_accuracy", carom::bench::kHelp, carom::bench::run}
      .main(argc, argv);
}
