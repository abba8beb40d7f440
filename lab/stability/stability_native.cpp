// Stiff and extreme cases of the native stepper.

#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "lab/stability/stability_cases.h"

#include "carom/native/sphere_stepper.h"

namespace carom::lab {

namespace {

using Measurements = std::vector<Measurement>;

constexpr BodyId kFloor = 1'000'000;
constexpr double kEarth = 9.81;   // m/s^2
constexpr double kDay = 86400.0;  // s

Sphere ballAt(BodyId id, const Vec3& position, const Vec3& velocity = Vec3::Zero()) {
  Sphere ball;
  ball.id = id;
  ball.radius = 0.5;
  ball.mass = 1.0;
  ball.position = position;
  ball.velocity = velocity;
  return ball;
}

SphereStepper stepperOf(SphereWorld world) {
  return orThrow(SphereStepper::create(std::move(world)));
}

/// Random numbers that are the same on every platform (SplitMix64, Steele et al. 2014).
class Numbers {
 public:
  explicit Numbers(std::uint64_t seed) : state_(seed) {}
  /// Returns the next number from -1 to 1.
  double next() {
    state_ += 0x9E3779B97F4A7C15ULL;
    std::uint64_t bits = state_;
    bits = (bits ^ (bits >> 30U)) * 0xBF58476D1CE4E5B9ULL;
    bits = (bits ^ (bits >> 27U)) * 0x94D049BB133111EBULL;
    bits ^= bits >> 31U;
    return static_cast<double>(bits >> 11U) * 0x1p-52 - 1.0;
  }
  Vec3 vector() {
    const double x = next();
    const double y = next();
    return {x, y, next()};
  }

 private:
  std::uint64_t state_;
};

/// A gas of `side`^3 balls of 0.25 to 0.5 m in a box, in
/// random motion of up to 1 m/s along each axis.
SphereWorld gas(int side, double restitution) {
  Numbers numbers(7);
  SphereWorld world;
  world.restSpeed = 0.0;
  const double half = 0.6 * side;
  for (int cell = 0; cell < side * side * side; ++cell) {
    const int row = cell / side;
    const int layer = row / side;
    const Vec3 corner(cell % side, row % side, layer);
    const Vec3 velocity = numbers.vector();
    Sphere ball =
        ballAt(static_cast<BodyId>(cell), 1.2 * corner + Vec3::Constant(0.6 - half), velocity);
    ball.radius = 0.375 + 0.125 * numbers.next();
    ball.mass = ball.radius * ball.radius * ball.radius;
    ball.restitution = restitution;
    world.spheres.push_back(ball);
  }
  for (int axis = 0; axis < 3; ++axis)
    for (const double side_ : {1.0, -1.0})
      world.planes.push_back({static_cast<BodyId>(kFloor + world.planes.size()),
                              side_ * Vec3::Unit(axis), -half, restitution});
  return world;
}

// ---- Two bodies

/// Velocities after a head-on collision, by the conservation of momentum and the definition of
/// restitution, in extended precision.
struct Outcome {
  long double first = 0.0L;
  long double second = 0.0L;
};
Outcome headOn(long double mass, long double other, long double speed, long double e) {
  const long double common = mass * speed / (mass + other);
  return {common - e * speed * other / (mass + other), common + e * speed * mass / (mass + other)};
}

SphereWorld pairOf(double mass, double other, double speed, double e) {
  SphereWorld world;
  world.restSpeed = 0.0;
  world.spheres = {ballAt(1, {-1.5, 0.0, 0.0}, {speed, 0.0, 0.0}), ballAt(2, Vec3::Zero())};
  world.spheres[0].mass = mass;
  world.spheres[1].mass = other;
  for (Sphere& sphere : world.spheres)
    sphere.restitution = e;
  return world;
}

Measurements massRatio(StabilityForm /*form*/) {
  Worst light;
  Worst heavy;
  Worst fast;
  for (const double ratio : {1e3, 1e6, 1e9, 1e12, 1e15}) {
    for (const double e : {0.0, 0.5, 1.0}) {
      SphereStepper onHeavy = stepperOf(pairOf(1.0, ratio, 1.0, e));
      onHeavy.advanceTo(1.0);
      const Outcome expected = headOn(1.0L, ratio, 1.0L, e);
      light.add(std::abs(onHeavy.state(0).velocity.x() - static_cast<double>(expected.first)));
      heavy.addShare(onHeavy.state(1).velocity.x(), static_cast<double>(expected.second));
      SphereStepper onLight = stepperOf(pairOf(ratio, 1.0, 1.0, e));
      onLight.advanceTo(1.0);
      fast.addShare(onLight.state(1).velocity.x(),
                    static_cast<double>(headOn(ratio, 1.0L, 1.0L, e).second));
    }
  }
  return {atMost("light_one_after_hitting_heavy", light.value(), 4e-16, "m/s"),
          atMost("heavy_one_share", heavy.value(), 4e-16),
          atMost("light_one_hit_by_heavy_share", fast.value(), 4e-16)};
}

/// Returns the number of collisions of a ball of mass 1 between a wall and a ball of mass `ratio`
/// that approaches at 1 m/s.
double galperinCount(double ratio, Worst& energyError) {
  SphereWorld world;
  world.restSpeed = 0.0;
  world.spheres = {ballAt(1, {2000.0, 0.0, 0.0}), ballAt(2, {5000.0, 0.0, 0.0}, {-1.0, 0.0, 0.0})};
  world.spheres[1].mass = ratio;
  world.planes = {{kFloor, Vec3::UnitX(), 0.0, 1.0}};
  SphereStepper stepper = stepperOf(world);
  const double energy = stepper.kineticEnergy();
  stepper.advanceTo(2e4);
  const auto collisions = static_cast<double>(stepper.counters().collisions);
  energyError.add(std::abs(stepper.kineticEnergy() / energy - 1.0) / collisions);
  return collisions;
}

Measurements galperin(StabilityForm form) {
  Worst energy;
  Measurements found = {
      exactly("collisions_at_1e2", galperinCount(1e2, energy), 31.0),
      exactly("collisions_at_1e4", galperinCount(1e4, energy), 314.0),
      exactly("collisions_at_1e6", galperinCount(1e6, energy), 3141.0),
      exactly("collisions_at_1e8", galperinCount(1e8, energy), 31415.0),
  };
  if (form == StabilityForm::full)
    found.push_back(exactly("collisions_at_1e9", galperinCount(1e9, energy),
                            std::floor(std::numbers::pi * std::sqrt(1e9))));
  found.push_back(atMost("energy_error_per_collision", energy.value(), 0x1p-52));
  return found;
}

// ---- Scales: the same numbers in other units are the same bits

/// The factors by which a world is scaled: powers of two are free of rounding.
struct Scale {
  double length = 1.0;
  double time = 1.0;
};

SphereWorld scaled(SphereWorld world, const Scale& scale) {
  const double speed = scale.length / scale.time;
  world.gravity *= speed / scale.time;
  world.restSpeed *= speed;
  for (Sphere& sphere : world.spheres) {
    sphere.radius *= scale.length;
    sphere.position *= scale.length;
    sphere.velocity *= speed;
  }
  for (Plane& plane : world.planes)
    plane.offset *= scale.length;
  return world;
}

std::vector<ImpulseEvent> eventsOf(const SphereWorld& world, double until) {
  SphereStepper stepper = stepperOf(world);
  const auto events = stepper.advanceTo(until);
  return {events.begin(), events.end()};
}

/// Counts the events of a world that differ in any bit from those of the scaled world, scaled back.
double eventsThatDiffer(const SphereWorld& world, const Scale& scale, double until) {
  const std::vector<ImpulseEvent> plain = eventsOf(world, until);
  const std::vector<ImpulseEvent> other = eventsOf(scaled(world, scale), until * scale.time);
  if (plain.size() != other.size() || plain.size() < 100)
    return static_cast<double>(std::max<std::size_t>(plain.size(), 1));
  double different = 0.0;
  for (std::size_t index = 0; index < plain.size(); ++index) {
    const bool same = plain[index].time * scale.time == other[index].time &&
                      plain[index].impulse * (scale.length / scale.time) == other[index].impulse &&
                      plain[index].position * scale.length == other[index].position;
    if (!same) different += 1.0;
  }
  return different;
}

/// Balls of 0.25 to 0.5 m that fall in a box and lose energy.
SphereWorld pouring() {
  SphereWorld world = gas(3, 0.7);
  world.gravity = {0.0, -kEarth, 0.0};
  world.restSpeed = 0.005;
  return world;
}

Measurements radius(StabilityForm /*form*/) {
  Measurements found;
  // Radii of 0.25 to 0.5 m times 2^-16 to 2^5, which is 4 um to 16 m, and far beyond.
  for (const int power : {-16, -10, -4, 5, 200, -200})
    found.push_back(exactly("events_that_differ_at_radius_2^" + std::to_string(power),
                            eventsThatDiffer(pouring(), {std::ldexp(1.0, power), 1.0}, 1.0), 0.0));
  return found;
}

Measurements speed(StabilityForm /*form*/) {
  Measurements found;
  // Speeds of 1 m/s times 2^-30 to 2^14, which is 1e-9 to 1.6e4 m/s, and far beyond.
  for (const int power : {-30, -20, -10, 7, 14, 100, -100})
    found.push_back(exactly("events_that_differ_at_speed_2^" + std::to_string(power),
                            eventsThatDiffer(gas(3, 1.0), {1.0, std::ldexp(1.0, -power)}, 3.0),
                            0.0));
  return found;
}

Measurements speedsApart(StabilityForm /*form*/) {
  SphereWorld world;
  world.restSpeed = 0.0;
  world.spheres = {ballAt(1, Vec3::Zero(), {1e-9, 0.0, 0.0}),
                   ballAt(2, {1e4 + 1.0, 0.0, 0.0}, {-1e4, 0.0, 0.0})};
  SphereStepper stepper = stepperOf(world);
  const auto events = stepper.advanceTo(2.0);
  const double time = events.empty() ? 0.0 : events.front().time;
  return {exactly("events", static_cast<double>(events.size()), 2.0),
          atMost("time_error", std::abs(time - 1.0), 1e-12, "s"),
          // The remaining error is the rounding of 1e4 m/s.
          nearly("slow_speed_handed_over", stepper.state(1).velocity.x(), 1e-9, 2e-3, "m/s")};
}

// Bodies and speeds at the ends of what scene files take: the ball, on its own, meets another one.
Measurements ends(StabilityForm /*form*/) {
  Worst times;
  Worst slow;
  Worst fast;
  Worst events;
  for (const double size : {1e-6, 1.0, 1e4})
    for (const double otherSize : {1e-6, 1e4})
      for (const double mass : {1e-21, 1e18})
        for (const double other : {1e-21, 1e18})
          for (const double speed : {1e-9, 1e4}) {
            SphereWorld world = pairOf(mass, other, speed, 1.0);
            const double gap = size;
            world.spheres[0].radius = size;
            world.spheres[1].radius = otherSize;
            world.spheres[0].position.x() = -(size + otherSize + gap);
            SphereStepper stepper = stepperOf(world);
            const auto heard = stepper.advanceTo(2.0 * gap / speed);
            events.add(std::abs(static_cast<double>(heard.size()) - 2.0));
            if (heard.empty()) continue;
            // The place of the first ball is rounded by half a bit of the sum of the radii.
            const double rounding = 0x1p-52 * (size + otherSize + gap) / gap;
            times.add(std::abs(heard.front().time * speed / gap - 1.0) / rounding);
            const Outcome expected = headOn(mass, other, speed, 1.0L);
            const auto first = static_cast<double>(expected.first);
            const auto second = static_cast<double>(expected.second);
            slow.add(std::abs(stepper.state(0).velocity.x() - first) / speed);
            fast.addShare(stepper.state(1).velocity.x(), second);
          }
  return {exactly("events_beside_one_collision", events.value(), 0.0),
          atMost("time_error_in_bits_of_the_place", times.value(), 2.0),
          atMost("first_one_share_of_its_speed", slow.value(), 4e-16),
          atMost("second_one_share", fast.value(), 4e-16)};
}

// ---- Restitution

Measurements restitutionOne(StabilityForm form) {
  SphereStepper stepper = stepperOf(gas(6, 1.0));
  const double energy = stepper.kineticEnergy();
  const std::uint64_t wanted = form == StabilityForm::brief ? 30'000 : 5'000'000;
  double time = 0.0;
  while (stepper.counters().collisions < wanted) {
    time += 10.0;
    stepper.advanceTo(time);
  }
  const auto collisions = static_cast<double>(stepper.counters().collisions);
  return {atLeast("collisions", collisions, static_cast<double>(wanted)),
          atMost("energy_error", std::abs(stepper.kineticEnergy() / energy - 1.0),
                 collisions * 0x1p-53)};
}

Measurements restitutionZero(StabilityForm /*form*/) {
  Worst together;
  Worst common;
  Worst events;
  for (const double ratio : {1e-9, 1e-3, 1.0, 3.0, 1e9}) {
    SphereWorld world = pairOf(1.0, ratio, 1.0, 0.0);
    world.restSpeed = 0.005;  // the balls touch: rounding looks like an approach
    SphereStepper stepper = stepperOf(world);
    events.add(std::abs(static_cast<double>(stepper.advanceTo(100.0).size()) - 2.0));
    const double first = stepper.state(0).velocity.x();
    together.add(std::abs(stepper.state(1).velocity.x() - first));
    common.add(std::abs(first - 1.0 / (1.0 + ratio)));
  }
  SphereWorld drop;
  drop.gravity = {0.0, -kEarth, 0.0};
  drop.spheres = {ballAt(1, {0.0, 1.5, 0.0})};
  drop.spheres[0].restitution = 0.0;
  drop.planes = {{kFloor, Vec3::UnitY(), 0.0, 0.0}};
  SphereStepper stepper = stepperOf(drop);
  const auto heard = static_cast<double>(stepper.advanceTo(10.0).size());
  return {atMost("events_beside_one_collision", events.value(), 0.0),
          atMost("speeds_apart", together.value(), 0x1p-47, "m/s"),
          atMost("common_speed_error", common.value(), 0x1p-52, "m/s"),
          exactly("events_of_a_dropped_ball", heard, 2.0),
          atMost("height_left", std::abs(stepper.state(0).position.y() - 0.5), 1e-15, "m")};
}

// A ball dropped from 1 m: the times of its bounces are a geometric series (Zeno's paradox).
Measurements zeno(StabilityForm /*form*/) {
  Worst times;
  Worst counts;
  Worst rest;
  for (const double e : {0.1, 0.5, 0.9, 0.99, 0.999}) {
    SphereWorld world;
    world.gravity = {0.0, -kEarth, 0.0};
    world.spheres = {ballAt(1, {0.0, 1.5, 0.0})};
    world.spheres[0].restitution = e;
    world.planes = {{kFloor, Vec3::UnitY(), 0.0, e}};
    SphereStepper stepper = stepperOf(world);
    const double fall = std::sqrt(2.0 / kEarth);
    const double end = fall * (1.0 + e) / (1.0 - e);
    const auto events = stepper.advanceTo(end + 1.0);
    const double bounces = std::floor(std::log(world.restSpeed / (kEarth * fall)) / std::log(e));
    counts.add(std::abs(static_cast<double>(events.size()) / 2.0 - (bounces + 1.0)));
    double expected = fall;
    double hop = 2.0 * fall * e;
    for (std::size_t index = 0; index < events.size(); index += 2) {
      times.addShare(events[index].time, expected);
      expected += hop;
      hop *= e;
    }
    rest.add(std::abs(stepper.state(0).position.y() - 0.5));
    rest.add(stepper.state(0).velocity.norm());
  }
  return {atMost("bounces_beside_the_series", counts.value(), 0.0),
          atMost("time_share", times.value(), 1e-12),
          atMost("height_and_speed_at_the_end", rest.value(), 1e-15)};
}

// The dropped ball without a speed of rest: it bounces infinitely often.
Measurements zenoWithoutRest(StabilityForm /*form*/) {
  Worst rest;
  for (const double e : {0.1, 0.5, 0.9}) {
    SphereWorld world;
    world.gravity = {0.0, -kEarth, 0.0};
    world.restSpeed = 0.0;
    world.spheres = {ballAt(1, {0.0, 1.5, 0.0})};
    world.spheres[0].restitution = e;
    world.planes = {{kFloor, Vec3::UnitY(), 0.0, e}};
    SphereStepper stepper = stepperOf(world);
    stepper.advanceTo(std::sqrt(2.0 / kEarth) * (1.0 + e) / (1.0 - e) + 1e-3);
    rest.add(std::abs(stepper.state(0).position.y() - 0.5));
    rest.add(stepper.state(0).velocity.norm());
  }
  return {atMost("height_and_speed_1_ms_after_the_limit", rest.value(), 1e-12)};
}

// ---- Grazing

SphereWorld passing(double offset, double distance) {
  SphereWorld world;
  world.restSpeed = 0.0;
  world.spheres = {ballAt(1, Vec3::Zero()), ballAt(2, {-distance, offset, 0.0}, {1.0, 0.0, 0.0})};
  return world;
}

Measurements grazing(StabilityForm /*form*/) {
  Worst speeds;
  double missed = 0.0;
  double touched = 0.0;
  // Distances from which the ball comes: 2 m, and 8 km.
  for (const double distance : {2.0, 8192.0}) {
    for (const int digits : {10, 20, 30, 40, 50, 53}) {
      const double inside = std::ldexp(1.0, -digits);
      const auto hits = eventsOf(passing(1.0 - inside, distance), 2.0 * distance);
      if (hits.size() != 2) missed += 1.0;
      if (hits.empty()) continue;
      // Cosine of the angle between the normal and the path, sqrt(1 - b^2), without cancellation.
      // The tolerance allows for half a bit in b and in the path.
      const double expected = std::sqrt(inside * (2.0 - inside));
      speeds.add(std::abs(hits.front().approachSpeed - expected) /
                 (0x1p-53 * (distance + 1.0 / expected)));
      const auto passes = eventsOf(passing(1.0 + 2.0 * inside, distance), 2.0 * distance);
      touched += static_cast<double>(passes.size());
    }
    touched += static_cast<double>(eventsOf(passing(1.0, distance), 2.0 * distance).size());
  }
  return {exactly("hits_missed", missed, 0.0), exactly("misses_that_hit", touched, 0.0),
          atMost("approach_speed_error_in_half_bits", speeds.value(), 1.0)};
}

// ---- Simultaneous contacts

SphereWorld row(int count, int moving) {
  SphereWorld world;
  for (int ball = 0; ball < count; ++ball)
    world.spheres.push_back(ballAt(static_cast<BodyId>(ball), {double(ball), 0.0, 0.0}));
  for (int ball = 0; ball < moving; ++ball) {
    world.spheres[static_cast<std::size_t>(ball)].position.x() -= 0.5;
    world.spheres[static_cast<std::size_t>(ball)].velocity.x() = 1.0;
  }
  return world;
}

/// Returns the error of a touching row of elastic balls, of which as many must leave as arrive.
double cradleError(int count, int moving) {
  SphereStepper stepper = stepperOf(row(count, moving));
  stepper.advanceTo(1.0);
  Worst error;
  for (int ball = 0; ball < count; ++ball)
    error.add(std::abs(stepper.state(static_cast<std::size_t>(ball)).velocity.x() -
                       (ball < count - moving ? 0.0 : 1.0)));
  return error.value();
}

double cornerError() {
  SphereWorld world;
  world.spheres = {ballAt(1, Vec3::Constant(1.5), Vec3(-1.0, -1.0, -1.0))};
  for (int axis = 0; axis < 3; ++axis)
    world.planes.push_back(
        {static_cast<BodyId>(kFloor + static_cast<BodyId>(axis)), Vec3::Unit(axis), 0.0, 1.0});
  SphereStepper stepper = stepperOf(world);
  stepper.advanceTo(2.0);
  return (stepper.state(0).velocity - Vec3::Ones()).norm();
}

// Two balls touch, and a third hits both at once: by momentum, energy and symmetry it goes back at
// 1/5, and they leave at 2 sqrt(3) / 5 along the lines of centres.
double ballOnTwoError() {
  const double half = std::sqrt(3.0) / 2.0;
  SphereWorld world;
  world.spheres = {ballAt(1, {-2.0, 0.0, 0.0}, {1.0, 0.0, 0.0}), ballAt(2, {half, 0.5, 0.0}),
                   ballAt(3, {half, -0.5, 0.0})};
  SphereStepper stepper = stepperOf(world);
  stepper.advanceTo(3.0);
  const Vec3 leaving = 2.0 * std::sqrt(3.0) / 5.0 * Vec3(half, 0.5, 0.0);
  return std::max((stepper.state(0).velocity - Vec3(-0.2, 0.0, 0.0)).norm(),
                  (stepper.state(1).velocity - leaving).norm());
}

Measurements simultaneous(StabilityForm /*form*/) {
  Worst cradle;
  for (int moving = 1; moving < 5; ++moving)
    cradle.add(cradleError(5, moving));
  return {atMost("cradle_of_5_error", cradle.value(), 1e-14, "m/s"),
          atMost("cradle_of_100_error", cradleError(100, 1), 1e-13, "m/s"),
          atMost("corner_of_3_planes_error", cornerError(), 1e-14, "m/s"),
          atMost("ball_on_two_error", ballOnTwoError(), 1e-14, "m/s")};
}

/// A heavy ball, a light one and a heavy one that touch; the first arrives at 1 m/s, and the light
/// one transmits its momentum to the last.
struct Squeezed {
  Worst momentum;  // relative error
  Worst energy;    // relative error
  Worst swapped;   // m/s, deviation from a swap of speeds, times the mass ratio

  void look(double ratio, Simultaneous how) {
    SphereWorld world = row(3, 1);
    world.simultaneous = how;
    for (Sphere& sphere : world.spheres) {
      sphere.mass = sphere.id == 1 ? 1.0 : ratio;
      sphere.stiffness = 1e9;
    }
    SphereStepper stepper = stepperOf(world);
    stepper.advanceTo(2.0);
    double sum = 0.0;
    for (std::size_t ball = 0; ball < 3; ++ball)
      sum += world.spheres[ball].mass * stepper.state(ball).velocity.x();
    momentum.addShare(sum, ratio);
    energy.addShare(stepper.kineticEnergy(), 0.5 * ratio);
    swapped.add(std::abs(stepper.state(2).velocity.x() - 1.0) * ratio);
  }
};

// By energy and momentum, the two heavy balls swap their speeds but for the light one's share: it
// leaves with at most 1 m/s, and so with 1 / M of the momentum.
Measurements squeezed(StabilityForm /*form*/) {
  Squeezed rigid;
  for (const double ratio : {1e3, 1e6, 1e9})
    rigid.look(ratio, Simultaneous::reflections);
  Squeezed springs;
  for (const double ratio : {1e3, 1e6})  // for higher ratios see docs/stability.md
    springs.look(ratio, Simultaneous::hertz);
  return {atMost("momentum_error", rigid.momentum.value(), 1e-12),
          atMost("energy_error", rigid.energy.value(), 1e-12),
          atMost("beside_a_swap_times_ratio", rigid.swapped.value(), 1.0, "m/s"),
          atMost("momentum_error_by_hertz", springs.momentum.value(), 1e-12),
          atMost("energy_error_by_hertz", springs.energy.value(), 1e-12),
          atMost("beside_a_swap_times_ratio_by_hertz", springs.swapped.value(), 1.0, "m/s")};
}

// Touching balls that follow Hertz's law have no other scale but the speed: their stiffness decides
// how long the impact takes, but not their final velocities.
Measurements stiffness(StabilityForm /*form*/) {
  Worst momentum;
  Worst energy;
  Worst spread;
  std::vector<double> first;
  for (const double modulus : {1e5, 1e7, 1e9, 1e11, 1.2e12}) {
    SphereWorld world = row(5, 1);
    world.simultaneous = Simultaneous::hertz;
    for (Sphere& sphere : world.spheres)
      sphere.stiffness = modulus;
    SphereStepper stepper = stepperOf(world);
    stepper.advanceTo(1.0);
    double sum = 0.0;
    for (std::size_t ball = 0; ball < 5; ++ball) {
      const double speed = stepper.state(ball).velocity.x();
      sum += speed;
      if (first.size() < 5) first.push_back(speed);
      spread.add(std::abs(speed - first[ball]));
    }
    momentum.add(std::abs(sum - 1.0));
    energy.add(std::abs(2.0 * stepper.kineticEnergy() - 1.0));
  }
  return {atMost("momentum_error", momentum.value(), 1e-12),
          atMost("energy_error", energy.value(), 1e-9),
          atMost("spread_from_1e5_to_1.2e12_Pa", spread.value(), 1e-9, "m/s"),
          // Hinch and Saint-Jean 1999: the last ball of a
          // long row gets 0.9857, of five a little more.
          nearly("speed_of_the_last", first[4], 0.989, 2e-3, "m/s")};
}

// ---- Stacks and piles

Measurements stack(StabilityForm form) {
  const int count = form == StabilityForm::brief ? 10 : 30;
  SphereWorld world;
  world.gravity = {0.0, -kEarth, 0.0};
  for (int ball = 0; ball < count; ++ball) {
    world.spheres.push_back(ballAt(static_cast<BodyId>(ball), {0.0, ball + 0.5, 0.0}));
    world.spheres.back().restitution = 0.5;
  }
  world.planes = {{kFloor, Vec3::UnitY(), 0.0, 0.5}};
  SphereStepper stepper = stepperOf(world);
  const auto events = stepper.advanceTo(10.0);
  Worst moved;
  for (std::size_t ball = 0; ball < world.spheres.size(); ++ball)
    moved.add((stepper.state(ball).position - world.spheres[ball].position).norm());
  return {exactly("events", static_cast<double>(events.size()), 0.0),
          atMost("moved_within_10_s", moved.value(), 1e-6, "m"),
          exactly("consistent", stepper.validate() ? 1.0 : 0.0, 1.0)};
}

// A ball up to a thousand million times as heavy stands on
// light ones: no solver iterations are needed.
Measurements stackMassRatio(StabilityForm /*form*/) {
  Worst moved;
  double events = 0.0;
  for (const double ratio : {1e3, 1e6, 1e9}) {
    SphereWorld world;
    world.gravity = {0.0, -kEarth, 0.0};
    for (int ball = 0; ball < 4; ++ball) {
      world.spheres.push_back(ballAt(static_cast<BodyId>(ball), {0.0, ball + 0.5, 0.0}));
      world.spheres.back().restitution = 0.5;
    }
    world.spheres.back().mass = ratio;
    world.planes = {{kFloor, Vec3::UnitY(), 0.0, 0.5}};
    SphereStepper stepper = stepperOf(world);
    events += static_cast<double>(stepper.advanceTo(10.0).size());
    for (std::size_t ball = 0; ball < world.spheres.size(); ++ball)
      moved.add((stepper.state(ball).position - world.spheres[ball].position).norm());
  }
  return {exactly("events", events, 0.0), atMost("moved_within_10_s", moved.value(), 1e-6, "m")};
}

Measurements pile(StabilityForm form) {
  const int side = form == StabilityForm::brief ? 3 : 6;
  SphereWorld world = scaled(gas(side, 0.5), {0.02, 0.02});
  world.gravity = {0.0, -kEarth, 0.0};
  world.restSpeed = 0.005;
  SphereStepper stepper = stepperOf(world);
  double energy = stepper.kineticEnergy() + stepper.potentialEnergy();
  const double first = energy;
  Worst grown;
  grown.add(0.0);
  double inconsistent = 0.0;
  for (int step = 1; step <= 200; ++step) {
    stepper.advanceTo(0.05 * step);
    const double now = stepper.kineticEnergy() + stepper.potentialEnergy();
    grown.add((now - energy) / std::abs(first));
    energy = now;
    if (!stepper.validate()) inconsistent += 1.0;
  }
  const auto before = stepper.counters().collisions;
  stepper.advanceTo(20.0);
  Worst fastest;
  Worst lowest;
  for (std::size_t ball = 0; ball < world.spheres.size(); ++ball) {
    fastest.add(stepper.state(ball).velocity.norm());
    lowest.add(world.planes[3].offset + world.spheres[ball].radius -
               stepper.state(ball).position.y());
  }
  return {atMost("energy_growth", grown.value(), 1e-7),
          exactly("looks_with_an_overlap", inconsistent, 0.0),
          atMost("sunk_into_the_floor", lowest.value(), 1e-12, "m"),
          atMost("fastest_after_20_s", fastest.value(), world.restSpeed, "m/s"),
          exactly("collisions_from_10_to_20_s",
                  static_cast<double>(stepper.counters().collisions - before), 0.0)};
}

// ---- A day

// A ball that bounces elastically from 1 m: bounce n is at (2 n - 1) t0. Each bounce rounds the
// speed; n roundings by one bit each in the same direction would shift the phase by n^2 t0 2^-53.
Measurements dayOfBounces(StabilityForm /*form*/) {
  SphereWorld world;
  world.gravity = {0.0, -kEarth, 0.0};
  world.spheres = {ballAt(1, {0.0, 1.5, 0.0})};
  world.planes = {{kFloor, Vec3::UnitY(), 0.0, 1.0}};
  SphereStepper stepper = stepperOf(world);
  const double energy = stepper.kineticEnergy() + stepper.potentialEnergy();
  const long double fall = std::sqrt(2.0L / static_cast<long double>(kEarth));
  const auto events = stepper.advanceTo(kDay);
  const std::size_t bounces = events.size() / 2;
  const auto expected = std::floor(0.5L * (static_cast<long double>(kDay) / fall + 1.0L));
  const long double last = (2.0L * static_cast<long double>(bounces) - 1.0L) * fall;
  const auto count = static_cast<double>(bounces);
  const double late =
      bounces == 0 ? kDay : std::abs(static_cast<double>(events[2 * bounces - 2].time - last));
  const double now = stepper.kineticEnergy() + stepper.potentialEnergy();
  return {exactly("bounces", count, static_cast<double>(expected)),
          atMost("last_bounce_late_or_early", late,
                 count * count * static_cast<double>(fall) * 0x1p-53, "s"),
          atMost("energy_error", std::abs(now / energy - 1.0), count * 0x1p-53)};
}

// A mass on a spring, in steps of 0.0625 of a radian: the leapfrog's own period is known in closed
// form, cos(angle) = 1 - (w h)^2 / 2 per step (Hairer, Lubich, Wanner 2003, Acta Numerica 12).
Measurements dayOfSwings(StabilityForm form) {
  constexpr double kStep = 0.0625;  // s: a day is a whole number of steps
  SphereWorld world;
  world.spheres = {ballAt(1, Vec3::UnitX())};
  world.springs = {{.sphere = 1, .stiffness = 1.0}};
  world.forceStep = kStep;
  SphereStepper stepper = stepperOf(world);
  const double end = form == StabilityForm::brief ? 0.1 * kDay : kDay;
  stepper.advanceTo(end);
  const long double step = kStep;
  const long double angle = 2.0L * std::asin(0.5L * step);
  const long double steps = static_cast<long double>(end) / step;
  const auto place = static_cast<double>(std::cos(angle * steps));
  return {
      atMost("place_error_at_the_end", std::abs(stepper.state(0).position.x() - place), 1e-9, "m"),
      atMost("beside_the_line",
             std::hypot(stepper.state(0).position.y(), stepper.state(0).position.z()), 0.0, "m")};
}

// Pairs of balls that collide one nanosecond after another, a day after the start.
Measurements timeAfterADay(StabilityForm /*form*/) {
  constexpr double kSpeed = 0x1p-10;  // m/s
  SphereWorld world;
  for (int pair = 0; pair < 100; ++pair) {
    const auto id = static_cast<BodyId>(2 * pair);
    const double gap = kSpeed * (kDay + 1e-9 * pair);
    world.spheres.push_back(ballAt(id, {0.0, 4.0 * pair, 0.0}));
    world.spheres.push_back(ballAt(id + 1, {1.0 + gap, 4.0 * pair, 0.0}, {-kSpeed, 0.0, 0.0}));
  }
  world.restSpeed = 0.0;
  SphereStepper stepper = stepperOf(world);
  const auto events = stepper.advanceTo(kDay + 1.0);
  Worst late;
  for (const ImpulseEvent& event : events) {
    const Sphere& mover = world.spheres[(event.body | 1U)];
    const long double expected =
        (static_cast<long double>(mover.position.x()) - 1.0L) / static_cast<long double>(kSpeed);
    late.add(std::abs(static_cast<double>(event.time - expected)));
  }
  return {exactly("events", static_cast<double>(events.size()), 200.0),
          atMost("time_error", late.value(), 0x1p-37, "s")};  // half of an ulp at 86400 s
}

// ---- Nonsense

Measurements nonsense(StabilityForm /*form*/) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinite = std::numeric_limits<double>::infinity();
  std::vector<SphereWorld> worlds;
  const auto add = [&worlds](auto change) {
    SphereWorld world = pairOf(1.0, 1.0, 1.0, 1.0);
    world.planes = {{kFloor, Vec3::UnitY(), -10.0, 1.0}};
    change(world);
    worlds.push_back(std::move(world));
  };
  for (const double odd : {nan, infinite, -infinite}) {
    add([odd](SphereWorld& world) { world.gravity.y() = odd; });
    add([odd](SphereWorld& world) { world.spheres[0].position.x() = odd; });
    add([odd](SphereWorld& world) { world.spheres[0].velocity.z() = odd; });
    add([odd](SphereWorld& world) { world.restSpeed = odd; });
    add([odd](SphereWorld& world) { world.planes[0].offset = odd; });
  }
  for (const double odd : {nan, infinite, 0.0, -1.0}) {
    add([odd](SphereWorld& world) { world.spheres[0].mass = odd; });
    add([odd](SphereWorld& world) { world.spheres[0].radius = odd; });
  }
  for (const double odd : {nan, infinite, -1e-9, 1.0 + 1e-9}) {
    add([odd](SphereWorld& world) { world.spheres[0].restitution = odd; });
    add([odd](SphereWorld& world) { world.planes[0].restitution = odd; });
  }
  add([](SphereWorld& world) { world.planes[0].normal = Vec3::Zero(); });
  add([](SphereWorld& world) { world.spheres[1].id = world.spheres[0].id; });
  add([](SphereWorld& world) { world.spheres[1].position = world.spheres[0].position; });
  add([](SphereWorld& world) { world.planes[0].offset = 0.0; });  // the plane cuts both spheres
  double taken = 0.0;
  for (SphereWorld& world : worlds)
    if (SphereStepper::create(std::move(world))) taken += 1.0;
  return {exactly("worlds_taken_of_" + std::to_string(worlds.size()), taken, 0.0)};
}

}  // namespace

void addNativeCases(std::vector<StabilityCase>& cases) {
  const std::vector<StabilityCase> all = {
      {"native.stiffness", "stiffness", "a ball hits four that touch, of 1e5 to 1.2e12 Pa",
       "no scale but the speed: the same velocities whatever the stiffness; momentum and energy "
       "stay",
       stiffness},
      {"native.mass_ratio", "mass ratio",
       "head-on collisions of mass ratios 1e3 to 1e15, e of 0, 0.5 and 1, either way round",
       "momentum and restitution: the light one leaves at (1 - e M) / (1 + M), the heavy one at "
       "(1 + e) / (1 + M)",
       massRatio},
      {"native.galperin", "mass ratio",
       "a ball between a wall and one that is 1e2 to 1e9 times as heavy",
       "the number of collisions is floor(pi sqrt(M / m)): digits of pi (Galperin 2003)", galperin},
      {"native.radius", "radius", "27 balls poured into a box, of 4 um to 16 m and far beyond",
       "with lengths and gravity scaled by a power of two, the same bits, scaled", radius},
      {"native.speed", "speed", "27 elastic balls in a box, at 1e-9 to 1.6e4 m/s and far beyond",
       "with times scaled by a power of two, the same bits, scaled", speed},
      {"native.speeds_apart", "speed", "1e-9 m/s against 1e4 m/s, head-on",
       "equal elastic balls swap their speeds, at 1 s", speedsApart},
      {"native.range_ends", "radius",
       "pairs of balls of 1 um to 10 km, 1e-21 to 1e18 kg, at 1e-9 and 1e4 m/s",
       "they meet after gap over speed, and part by momentum and energy", ends},
      {"native.restitution_one", "restitution", "216 elastic balls in a box",
       "energy stays, but for half a bit of rounding a collision", restitutionOne},
      {"native.restitution_zero", "restitution",
       "balls of mass ratios to 1e9, and a ball on the floor, that do not bounce at all",
       "they go on together at the speed of their centre of mass; the ball lies where it fell",
       restitutionZero},
      {"native.zeno", "restitution", "a ball dropped from 1 m, e from 0.1 to 0.999",
       "bounces at a geometric series of times, down to the speed of rest; rest after "
       "t0 (1 + e) / (1 - e)",
       zeno},
      {"native.zeno_without_rest", "restitution",
       "the same with a speed of rest of 0: infinitely many bounces in a finite time",
       "at rest after t0 (1 + e) / (1 - e)", zenoWithoutRest},
      {"native.grazing", "grazing",
       "a ball passes another off its centre by 1 -+ 2^-10 to 2^-53 of the sum of their radii",
       "inside it touches at v sqrt(1 - b^2), outside it does not", grazing},
      {"native.simultaneous", "simultaneous contacts",
       "touching cradles of 5 and 100, a corner of three planes, a ball on two",
       "as many leave as come; all speeds are reversed; -1/5 and 2 sqrt(3) / 5 of the speed",
       simultaneous},
      {"native.squeezed", "mass ratio",
       "a ball between two that are 1e3 to 1e9 times as heavy (by Hertz's law to 1e6), touching",
       "momentum and energy: the heavy ones swap their speeds but for the light one's share",
       squeezed},
      {"native.stack", "stacks and piles", "a column of balls on the floor for 10 s",
       "exactly upright it stays, without a sound", stack},
      {"native.stack_mass_ratio", "stacks and piles",
       "a ball 1e3 to 1e9 times as heavy on three others, for 10 s",
       "exactly upright they stay, without a sound", stackMassRatio},
      {"native.pile", "stacks and piles",
       "marbles of 5 to 10 mm poured into a box, e = 0.5, for 20 s",
       "energy never grows, nothing overlaps or sinks; without friction all ends below the speed "
       "of "
       "rest, and is silent",
       pile},
      {"native.day_of_bounces", "24 hours", "an elastic ball bounces from 1 m for 24 h",
       "the n-th bounce is at (2 n - 1) sqrt(2 h / g), but for a bit of rounding in each speed",
       dayOfBounces},
      {"native.day_of_swings", "24 hours", "a mass swings on a spring for 24 h",
       "the leapfrog's own closed form, A cos(n angle)", dayOfSwings},
      {"native.time_after_a_day", "24 hours",
       "100 pairs meet one nanosecond after the other, 24 h after the start",
       "gap over speed, to half of the spacing of doubles at 86400 s, 7.3 ps", timeAfterADay},
      {"native.nonsense", "nonsense",
       "worlds with a value that is no number, infinite, negative, or beyond its range",
       "each is refused", nonsense},
  };
  cases.insert(cases.end(), all.begin(), all.end());
}

}  // namespace carom::lab
