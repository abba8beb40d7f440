#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/native/sphere_worlds.h"

namespace carom::test {
namespace {

void expectValid(const SphereStepper& stepper) {
  EXPECT_TRUE(valid(stepper));
}

/// Mean time between passes of a coordinate through zero from above.
template <class Coordinate>
double periodOf(SphereStepper& stepper, double step, double until, const Coordinate& coordinate) {
  double before = coordinate();
  double first = 0.0;
  double last = 0.0;
  int passes = 0;
  for (double time = step; time < until; time += step) {
    stepper.advanceTo(time);
    const double now = coordinate();
    if (before > 0.0 && now <= 0.0) {
      last = time - step * now / (now - before);
      if (passes == 0) first = last;
      ++passes;
    }
    before = now;
  }
  return (last - first) / (passes - 1);
}

/// Period of a pendulum: 2 pi sqrt(L / g) / M(1, cos(angle / 2)), with Gauss's arithmetic-geometric
/// mean M.
double pendulumPeriod(double length, double gravity, double angle) {
  double mean = 1.0;
  double geometric = std::cos(0.5 * angle);
  for (int step = 0; step < 20; ++step) {
    const double next = 0.5 * (mean + geometric);
    geometric = std::sqrt(mean * geometric);
    mean = next;
  }
  return 2.0 * std::numbers::pi * std::sqrt(length / gravity) / mean;
}

SphereWorld pendulum(double angle) {
  SphereWorld world;
  world.gravity = kEarthGravity;
  world.spheres = {sphereAt(1, {std::sin(angle), -std::cos(angle), 0.0})};
  world.rods = {{1, kAnchor, Vec3::Zero()}};
  return world;
}

/// Five balls, `gap` apart, on pairs of rods of 0.2 m, the first one drawn aside.
SphereWorld swingingCradle(double angle, double gap) {
  const double radius = 0.01;
  SphereWorld world;
  world.gravity = kEarthGravity;
  for (int ball = 0; ball < 5; ++ball) {
    const double x = ball * (2.0 * radius + gap);
    const double drawn = ball == 0 ? angle : 0.0;
    Sphere sphere = sphereAt(static_cast<BodyId>(ball + 1),
                             {x - 0.2 * std::sin(drawn), -0.2 * std::cos(drawn), 0.0});
    sphere.radius = radius;
    world.spheres.push_back(sphere);
    for (const double side : {-0.1, 0.1})
      world.rods.push_back({sphere.id, kAnchor, {x, 0.0, side}});
  }
  return world;
}

}  // namespace

// ---- Rods

TEST(Rods, PendulumHasThePeriodOfTheEllipticIntegral) {
  for (const double angle : {0.1, 1.5, 3.0}) {
    SphereStepper stepper = stepperOf(pendulum(angle));
    const double expected = pendulumPeriod(1.0, 9.81, angle);
    const double period =
        periodOf(stepper, 1e-3, 4.5 * expected, [&] { return stepper.state(0).position.x(); });
    EXPECT_NEAR(period, expected, 2e-6 * expected) << angle;
    expectValid(stepper);
  }
}

TEST(Rods, KeepTheirLengthBetweenTheStepsToo) {
  SphereStepper stepper = stepperOf(pendulum(1.5));
  for (int step = 1; step < 2000; ++step) {
    stepper.advanceTo(1.234e-3 * step);
    ASSERT_NEAR(stepper.state(0).position.norm(), 1.0, 1e-9);
  }
}

TEST(Rods, PendulumKeepsItsEnergyWithoutDrift) {
  SphereStepper stepper = stepperOf(pendulum(1.5));
  const double start = energyOf(stepper);
  for (int second = 1; second <= 100; ++second) {
    stepper.advanceTo(second);
    ASSERT_NEAR(energyOf(stepper), start, 1e-5 * 0.2 * 9.81);
  }
}

TEST(Rods, DumbbellTurnsWithItsAngularMomentum) {
  SphereWorld world;
  world.spheres = {sphereAt(1, {0.3, 0.0, 0.0}, {0.0, 2.0, 0.5}),
                   sphereAt(2, {-0.3, 0.0, 0.0}, {0.0, -1.0, 0.5})};
  world.spheres[1].mass = 0.4;
  world.rods = {{1, 2}};
  SphereStepper stepper = stepperOf(world);
  const auto momentum = [&] {
    return Vec3(0.2 * stepper.state(0).velocity + 0.4 * stepper.state(1).velocity);
  };
  const auto turning = [&] {
    return Vec3(0.2 * stepper.state(0).position.cross(stepper.state(0).velocity) +
                0.4 * stepper.state(1).position.cross(stepper.state(1).velocity));
  };
  const Vec3 momentumBefore = momentum();
  const Vec3 turningBefore = turning();
  stepper.advanceTo(10.0);
  EXPECT_LT((momentum() - momentumBefore).norm(), 1e-12);
  EXPECT_LT((turning() - turningBefore).norm(), 1e-4 * turningBefore.norm());
  EXPECT_NEAR((stepper.state(0).position - stepper.state(1).position).norm(), 0.6, 1e-10);
}

TEST(Rods, AnImpactTurnsADumbbellAsItsInertiaSays) {
  // A ball hits one end of a dumbbell. At right angles to the rod the other end does not feel it,
  // since a massless rod transmits nothing there; along the rod the dumbbell is one body with both
  // masses.
  for (const bool along : {false, true}) {
    SphereWorld world;
    world.spheres = {sphereAt(1, {0.0, 0.0, 0.0}), sphereAt(2, {0.3, 0.0, 0.0}),
                     sphereAt(3, along ? Vec3(-0.2, 0.0, 0.0) : Vec3(0.0, -0.2, 0.0),
                              along ? Vec3(1.0, 0.0, 0.0) : Vec3(0.0, 1.0, 0.0))};
    world.rods = {{1, 2}};
    SphereStepper stepper = stepperOf(world);
    const auto events = stepper.advanceTo(0.11);
    ASSERT_EQ(events.size(), 2U);
    EXPECT_NEAR(events[0].effectiveMass, along ? 0.4 / 3.0 : 0.1, 1e-12);
    const double speed = along ? stepper.state(2).velocity.x() : stepper.state(2).velocity.y();
    EXPECT_NEAR(speed, along ? -1.0 / 3.0 : 0.0, 1e-12);
  }
}

TEST(Rods, ADumbbellAtRestThatIsHitTurnsAtItsNewSpeed) {
  // The dumbbell rests in free space, so that no earlier speed tells how fast it will turn: end 1
  // takes over the speed of 1 m/s of an equal ball at right angles, and the dumbbell turns with 1 /
  // 0.3 rad/s about a centre at 0.5 m/s.
  SphereWorld world;
  world.spheres = {sphereAt(1, {0.0, 0.0, 0.0}), sphereAt(2, {0.3, 0.0, 0.0}),
                   sphereAt(3, {0.0, -0.2, 0.0}, {0.0, 1.0, 0.0})};
  world.rods = {{1, 2}};
  SphereStepper stepper = stepperOf(world);
  for (const double time : {0.2, 0.35, 0.5}) {
    stepper.advanceTo(time);
    const double angle = (time - 0.1) / 0.3;
    const Vec3 arm = 0.15 * Vec3(std::cos(angle), -std::sin(angle), 0.0);
    const Vec3 centre(0.15, 0.5 * (time - 0.1), 0.0);
    EXPECT_LT((stepper.state(0).position - (centre - arm)).norm(), 1e-5) << time;
    EXPECT_LT((stepper.state(1).position - (centre + arm)).norm(), 1e-5) << time;
  }
}

TEST(Rods, KeepTheirLengthOnAWallToo) {
  // A dumbbell drifts onto a wall, one ball first, too slowly to be heard; the wall does not hold
  // it.
  SphereWorld world;
  world.spheres = {sphereAt(1, {0.0, 0.051, 0.0}, {0.0, -0.003, 0.0}),
                   sphereAt(2, {0.3, 0.2, 0.0}, {0.0, -0.003, 0.0})};
  world.rods = {{1, 2}};
  world.planes = {floorPlane(0.5)};
  for (Sphere& sphere : world.spheres)
    sphere.restitution = 0.5;
  SphereStepper stepper = stepperOf(world);
  const double length = (world.spheres[0].position - world.spheres[1].position).norm();
  for (int step = 1; step <= 400; ++step) {
    stepper.advanceTo(0.5 * step);
    ASSERT_NEAR((stepper.state(0).position - stepper.state(1).position).norm(), length, 1e-9);
    expectValid(stepper);
  }
}

/// A bob of a pendulum without gravity, at 1 m/s, which an obstacle meets at half a right angle.
SphereWorld bobBefore(double restitution) {
  SphereWorld world;
  world.spheres = {sphereAt(1, {0.0, -1.0, 0.0}, {1.0, 0.0, 0.0})};
  world.spheres[0].restitution = restitution;
  world.rods = {{1, kAnchor, Vec3::Zero()}};
  return world;
}

// The rod takes part in the impulse, so that the bob swings back with its restitution's share.
TEST(Rods, ABobSwingsBackFromTheEdgeOfABlock) {
  for (const double restitution : {1.0, 0.5}) {
    SphereWorld world = bobBefore(restitution);
    const double aside = 0.2;
    const Vec3 contact(std::sin(aside), -std::cos(aside), 0.0);
    const Vec3 normal = Vec3(-1.0, 1.0, 0.0).normalized();
    const Vec3 edge = contact - world.spheres[0].radius * normal;
    Box block;
    block.id = 9;
    block.centre = edge + Vec3(0.5, -0.5, 0.0);
    block.halfExtents = Vec3::Constant(0.5);
    block.restitution = restitution;
    world.boxes = {block};
    SphereStepper stepper = stepperOf(world);
    stepper.advanceTo(0.3);
    EXPECT_NEAR(stepper.state(0).velocity.norm(), restitution, 1e-6);
    EXPECT_LT(stepper.state(0).velocity.x(), 0.0);
    expectValid(stepper);
  }
}

TEST(Rods, ABobSwingsBackFromAPlaneThatOscillates) {
  for (const double restitution : {1.0, 0.5}) {
    SphereWorld world = bobBefore(restitution);
    const double aside = 0.2;
    const Vec3 contact(std::sin(aside), -std::cos(aside), 0.0);
    Plane plane;
    plane.id = 9;
    plane.restitution = restitution;
    plane.normal = Vec3(-1.0, 1.0, 0.0).normalized();
    plane.offset = plane.normal.dot(contact) - world.spheres[0].radius;
    plane.oscillation = {.amplitude = 1e-9 * plane.normal, .frequency = 10.0};
    world.planes = {plane};
    SphereStepper stepper = stepperOf(world);
    stepper.advanceTo(0.3);
    EXPECT_NEAR(stepper.state(0).velocity.norm(), restitution, 1e-6);
    EXPECT_LT(stepper.state(0).velocity.x(), 0.0);
    expectValid(stepper);
  }
}

TEST(Rods, SwingingCradlePassesItsSwingOnAndBack) {
  for (const double gap : {0.0, 1e-7}) {
    const double angle = 0.5;
    SphereStepper stepper = stepperOf(swingingCradle(angle, gap));
    const double start = energyOf(stepper);
    const double period = pendulumPeriod(0.2, 9.81, angle);
    // After half a period the last ball is as far out as the first one was, and the others hang.
    stepper.advanceTo(0.5 * period);
    EXPECT_NEAR(stepper.state(4).position.x() - 4.0 * (0.02 + gap), 0.2 * std::sin(angle), 2e-4);
    for (std::size_t ball = 0; ball < 4; ++ball)
      EXPECT_NEAR(stepper.state(ball).position.y(), -0.2, 1e-5);
    EXPECT_EQ(stepper.counters().collisions, 4U);
    stepper.advanceTo(period);
    EXPECT_NEAR(stepper.state(0).position.x(), -0.2 * std::sin(angle), 4e-4);
    EXPECT_EQ(stepper.counters().collisions, 8U);
    EXPECT_NEAR(energyOf(stepper), start, 1e-4 * std::abs(start));
    expectValid(stepper);
  }
}

namespace {

/// Two spheres of 1 kg that fly apart and pull two rods of 1 m straight, with a bead of 1 mg where
/// the rods meet. With D the distance of the two and y the height of the bead, D^2 / 4 + y^2 = 1.
struct BeadOnRods {
  static constexpr double kBead = 1e-6;  // kg
  static constexpr double kSpeed = 1.0;  // m/s, of each, at the start, where D is 1 m

  static SphereWorld world() {
    const double height = std::sqrt(0.75);
    SphereWorld world;
    world.spheres = {sphereAt(1, {-0.5, 0.0, 0.0}, {-kSpeed, 0.0, 0.0}),
                     sphereAt(2, {0.0, height, 0.0}, {0.0, -0.5 * kSpeed / height, 0.0}),
                     sphereAt(3, {0.5, 0.0, 0.0}, {kSpeed, 0.0, 0.0})};
    for (Sphere& sphere : world.spheres)
      sphere.mass = sphere.id == 2 ? kBead : 1.0;
    world.rods = {{1, 2}, {2, 3}};
    return world;
  }

  /// Energy for D = 2 sin(angle) and D' = 1 m/s.
  static double inertia(double angle) {
    const double across = std::tan(angle);
    return 0.25 + kBead * across * across / 8.0;
  }

  /// Time (s) until the rods are straight: the integral of dD / D', where the energy is constant,
  /// by Simpson's rule.
  static double timeUntilStraight() {
    constexpr int kSteps = 20000;
    const double begin = std::numbers::pi / 6.0;  // D = 1
    const double step = (0.5 * std::numbers::pi - begin) / kSteps;
    const double energy = inertia(begin) * 4.0 * kSpeed * kSpeed;
    double sum = 0.0;
    for (int k = 0; k <= kSteps; ++k) {
      const double angle = begin + k * step;
      const double cosine = std::cos(angle);
      const double sine = std::sin(angle);
      const double weight = k == 0 || k == kSteps ? 1.0 : 2.0 + 2.0 * (k % 2);
      sum +=
          weight * 2.0 * std::sqrt((0.25 * cosine * cosine + kBead * sine * sine / 8.0) / energy);
    }
    return sum * step / 3.0;
  }
};

}  // namespace

// The bead is thrown across at up to 1400 m/s when the rods become straight, and the two heavy
// spheres come back as fast as they went: the motion is symmetric about that moment.
TEST(Rods, ALightBeadBetweenHeavySpheresIsThrownAcross) {
  SphereStepper stepper = stepperOf(BeadOnRods::world());
  const double energy = energyOf(stepper);
  const double straight = BeadOnRods::timeUntilStraight();
  stepper.advanceTo(straight);
  EXPECT_NEAR(energyOf(stepper), energy, 1e-3 * energy);
  stepper.advanceTo(2.0 * straight);
  expectValid(stepper);
  EXPECT_NEAR(energyOf(stepper), energy, 1e-4 * energy);
  EXPECT_NEAR(stepper.state(0).velocity.x(), BeadOnRods::kSpeed, 1e-4);
  EXPECT_NEAR(stepper.state(2).velocity.x(), -BeadOnRods::kSpeed, 1e-4);
  EXPECT_NEAR(stepper.state(0).position.x(), -0.5, 1e-4);
  EXPECT_NEAR(stepper.state(1).position.y(), -std::sqrt(0.75), 1e-4);
}

// A heavy pendulum on two rods with a bead between them: the bead's own swing, 1000 times as fast,
// must neither grow nor change the slow one, which is a pendulum's of 2 m.
TEST(Rods, AHeavyPendulumBelowALightBeadSwingsAsIfItWereNotThere) {
  constexpr double kAngle = 0.3;
  SphereWorld world;
  world.gravity = kEarthGravity;
  const Vec3 along(std::sin(kAngle), -std::cos(kAngle), 0.0);
  world.spheres = {sphereAt(1, along), sphereAt(2, 2.0 * along)};
  world.spheres[0].mass = 1e-6;
  world.spheres[1].mass = 1.0;
  world.rods = {{1, kAnchor, Vec3::Zero()}, {1, 2}};
  SphereStepper stepper = stepperOf(world);
  const double energy = energyOf(stepper);
  stepper.advanceTo(0.5 * pendulumPeriod(2.0, 9.81, kAngle));
  expectValid(stepper);
  EXPECT_NEAR(energyOf(stepper), energy, 1e-5);
  EXPECT_NEAR(stepper.state(1).position.x(), -2.0 * std::sin(kAngle), 1e-4);
  EXPECT_NEAR(stepper.state(0).position.x(), -std::sin(kAngle), 1e-4);
}

// ---- Springs

TEST(Springs, MoveAsTheLeapfrogOfAnOscillatorDoes) {
  // Position Verlet of x'' = -w^2 x from rest is A cos(n angle), with cos(angle) = 1 - (w h)^2 / 2.
  const double frequency = std::sqrt(100.0 * 1.5);
  for (const double step : {0x1p-6, 0x1p-8}) {
    SphereWorld world;
    world.spheres = {sphereAt(1, {0.55, 0.0, 0.0}), sphereAt(2, {-0.55, 0.0, 0.0})};
    world.spheres[0].mass = 1.0;
    world.spheres[1].mass = 2.0;
    world.springs = {{1, 2, Vec3::Zero(), 1.0, 100.0, 0.0}};
    world.forceStep = step;
    SphereStepper stepper = stepperOf(world);
    const double angle = std::acos(1.0 - 0.5 * frequency * frequency * step * step);
    for (int steps = 100; steps <= 2000; steps += 100) {
      stepper.advanceTo(steps * step);
      const double stretch = stepper.state(0).position.x() - stepper.state(1).position.x() - 1.0;
      ASSERT_NEAR(stretch, 0.1 * std::cos(steps * angle), 1e-11);
    }
    EXPECT_NEAR(stepper.state(0).velocity.x() + 2.0 * stepper.state(1).velocity.x(), 0.0, 1e-12);
  }
}

TEST(Springs, DampedOscillationDecaysAsItsClosedForm) {
  SphereWorld world;
  world.spheres = {sphereAt(1, {0.6, 0.0, 0.0})};
  world.spheres[0].mass = 1.0;
  world.springs = {{1, kAnchor, Vec3::Zero(), 0.5, 100.0, 2.0}};
  SphereStepper stepper = stepperOf(world);
  const double decay = 1.0;
  const double frequency = std::sqrt(100.0 - decay * decay);
  for (double time = 0.05; time < 3.0; time += 0.05) {
    stepper.advanceTo(time);
    const double expected =
        0.1 * std::exp(-decay * time) *
        (std::cos(frequency * time) + decay / frequency * std::sin(frequency * time));
    ASSERT_NEAR(stepper.state(0).position.x() - 0.5, expected, 1e-6);
  }
}

TEST(Springs, BallsOnASpringStillCollideExactly) {
  // The ball, on a spring along x, flies against one heavy ball as a wall: the time of contact is
  // that of the path.
  SphereWorld world;
  world.spheres = {sphereAt(1, {0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}), sphereAt(2, {0.5, 0.0, 0.0})};
  world.spheres[1].mass = 1e9;
  world.springs = {{1, kAnchor, Vec3(-10.0, 0.0, 0.0), 10.0, 0.2 * 4.0, 0.0}};  // w = 2/s
  SphereStepper stepper = stepperOf(world);
  const auto events = stepper.advanceTo(1.0);
  ASSERT_EQ(events.size(), 2U);
  // x = sin(w t) / w reaches 0.4 at asin(0.8) / 2 (the spring is long: it stays along x). The
  // method is of second order: (w h)^2 is 2.5e-5.
  EXPECT_NEAR(events[0].time, 0.5 * std::asin(0.8), 2.5e-5 * 0.46);
  EXPECT_NEAR(events[0].approachSpeed, 0.6, 2.5e-5 * 0.6);
}

// A spring draws a ball that hangs on a rod onto the floor at 7.5e7 m/s^2: a hop that would last as
// long as under gravity would throw it off at 3.7 km/s.
TEST(Rods, HopsOfABallThatIsDrawnDownGiveItNoEnergy) {
  SphereWorld world;
  world.planes = {floorPlane(0.5)};
  world.spheres = {sphereAt(1, {0.0, 0.05, 0.0})};
  world.springs = {{1, kAnchor, {0.0, -0.1, 0.0}, 0.0, 1e8, 0.0}};
  world.rods = {{1, kAnchor, {0.0, 0.05, 1.0}}};
  SphereStepper stepper = stepperOf(world);
  const double energy = energyOf(stepper);
  for (int millisecond = 1; millisecond <= 3; ++millisecond) {
    stepper.advanceTo(1e-3 * millisecond);
    EXPECT_LT(energyOf(stepper), energy + 1e-4 * energy);
    expectValid(stepper);
  }
}

// ---- Fields and drag

TEST(ForceFields, InverseSquareKeepsAKeplerOrbit) {
  SphereWorld world;
  world.spheres = {sphereAt(1, {1.0, 0.0, 0.0}, {0.0, 1.2, 0.0})};
  world.fields = {{Vec3::Zero(), 0.0, 1.0}};
  SphereStepper stepper = stepperOf(world);
  const double start = energyOf(stepper);
  const double axis = 1.0 / (2.0 - 1.2 * 1.2);  // vis viva, from the orbit's nearest point
  const double period = 2.0 * std::numbers::pi * axis * std::sqrt(axis);
  stepper.advanceTo(period);
  EXPECT_LT((stepper.state(0).position - Vec3::UnitX()).norm(), 1e-4);
  EXPECT_NEAR(energyOf(stepper), start, 1e-6);
}

TEST(ForceFields, DragReachesItsTerminalSpeed) {
  SphereWorld world;
  world.gravity = kEarthGravity;
  world.spheres = {sphereAt(1, Vec3::Zero())};
  world.drag = {2.0, Vec3(1.0, 0.0, 0.0)};
  SphereStepper stepper = stepperOf(world);
  for (const double time : {0.1, 0.5, 3.0}) {
    stepper.advanceTo(time);
    const double reached = 1.0 - std::exp(-2.0 * time);
    EXPECT_NEAR(stepper.state(0).velocity.y(), -9.81 / 2.0 * reached, 1e-4);
    EXPECT_NEAR(stepper.state(0).velocity.x(), reached, 1e-4);
  }
}

TEST(ForceFields, WhereAdvanceToStopsChangesNoBit) {
  SphereWorld world = swingingCradle(0.5, 0.0);
  world.springs = {{1, 2, Vec3::Zero(), 0.02, 3.0, 0.01}};
  world.drag.rate = 0.1;
  SphereStepper whole = stepperOf(world);
  SphereStepper pieces = stepperOf(world);
  whole.advanceTo(2.0);
  for (int piece = 1; piece <= 2048; ++piece)
    pieces.advanceTo(piece / 1024.0);
  for (std::size_t ball = 0; ball < 5; ++ball) {
    EXPECT_EQ(whole.state(ball).position, pieces.state(ball).position);
    EXPECT_EQ(whole.state(ball).velocity, pieces.state(ball).velocity);
  }
}

// The caller may take as many events at a time as suit it.
TEST(SphereStepper, TakingFewEventsAtATimeChangesNoBit) {
  SphereStepper whole = stepperOf(gasInBox(4, 1.0, 7));
  SphereStepper pieces = stepperOf(gasInBox(4, 1.0, 7));
  const auto all = whole.advanceTo(2.0);
  std::vector<ImpulseEvent> found;
  while (pieces.time() < 2.0) {
    const auto some = pieces.advanceTo(2.0, 6);
    EXPECT_TRUE(some.size() >= 6 || pieces.time() == 2.0);
    found.insert(found.end(), some.begin(), some.end());
  }
  ASSERT_GT(all.size(), 100U);
  ASSERT_EQ(found.size(), all.size());
  for (std::size_t event = 0; event < all.size(); ++event) {
    EXPECT_EQ(found[event].time, all[event].time);
    EXPECT_EQ(found[event].impulse, all[event].impulse);
  }
  EXPECT_EQ(whole.state(0).position, pieces.state(0).position);
}

// A pendulum has many steps, and no event at which a caller could look at the clock.
TEST(SphereStepper, ReturnsWhereThereIsMuchWorkWithoutEvents) {
  SphereStepper whole = stepperOf(pendulum(1.0));
  SphereStepper pieces = stepperOf(pendulum(1.0));
  whole.advanceTo(1.0);
  int calls = 0;
  for (double before = -1.0; pieces.time() < 1.0; ++calls) {
    ASSERT_GT(pieces.time(), before);
    before = pieces.time();
    EXPECT_TRUE(pieces.advanceTo(1.0, 2).empty());
  }
  EXPECT_GT(calls, 10);
  EXPECT_EQ(whole.state(0).position, pieces.state(0).position);
}

}  // namespace carom::test
