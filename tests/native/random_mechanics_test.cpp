// Tests small random worlds with everything at once: friction, spin, laws of restitution, springs,
// rods, fields, drag, walls across each other. None has a known answer, but each must come to its
// end, with a conservation check that balances, and without energy from nowhere.

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/native/sphere_worlds.h"

namespace carom {
namespace {

using namespace test;

class RandomWorld {
 public:
  explicit RandomWorld(std::uint64_t seed) : random_(seed) {
    const double restitution = chance(0.3) ? 1.0 : random_.between(0.0, 1.0);
    world_ = gasInBox(chance(0.5) ? 2 : 3, restitution, seed);
    if (chance(0.8)) world_.gravity = kEarthGravity;
    if (chance(0.3)) world_.restSpeed = random_.between(0.0, 0.02);
    if (chance(0.3)) addSlope(restitution);
    if (chance(0.6)) addFriction();
    if (chance(0.3)) addLaws();
    if (chance(0.5)) addSprings();
    if (chance(0.5)) addRods();
    if (chance(0.2)) world_.fields = {{random_.inCube(0.1), random_.between(-10.0, 50.0), 0.0}};
    if (chance(0.2)) world_.drag = {random_.between(0.0, 2.0), random_.inCube(1.0)};
  }
  const SphereWorld& world() const { return world_; }
  /// True if only gravity, contacts and rods act, so that energy cannot grow.
  bool hasEnergyOfItsOwn() const {
    return world_.fields.empty() && world_.drag.rate == 0.0 && world_.springs.empty();
  }

 private:
  bool chance(double probability) { return random_.between(0.0, 1.0) < probability; }

  /// Adds a slope through the box and removes the spheres that would be in it.
  void addSlope(double restitution) {
    const Plane slope{kFirstPlane + 7, Vec3(0.48, 0.8, 0.36), -0.2, restitution};
    std::erase_if(world_.spheres, [&](const Sphere& sphere) {
      return slope.normal.dot(sphere.position) - slope.offset <= sphere.radius;
    });
    world_.planes.push_back(slope);
  }
  void addFriction() {
    for (Sphere& sphere : world_.spheres) {
      sphere.friction.sliding = random_.between(0.0, 1.0);
      sphere.friction.rolling = random_.between(0.0, 0.05);
      sphere.friction.pivoting = random_.between(0.0, 1e-3);
      sphere.friction.spin = random_.inCube(50.0);
    }
    for (Plane& plane : world_.planes)
      plane.friction = random_.between(0.0, 1.0);
  }
  void addLaws() {
    const SpeedLaw law = chance(0.5) ? SpeedLaw::plastic : SpeedLaw::viscoelastic;
    for (Sphere& sphere : world_.spheres)
      sphere.restitutionLaw = {law, 1.0};
  }
  std::pair<BodyId, BodyId> ends() {
    const auto last = static_cast<double>(world_.spheres.size()) - 0.01;
    const auto one = static_cast<std::size_t>(random_.between(0.0, last));
    const auto other = static_cast<std::size_t>(random_.between(0.0, last));
    return {world_.spheres[one].id, one == other ? kAnchor : world_.spheres[other].id};
  }
  void addSprings() {
    const auto count = static_cast<int>(random_.between(1.0, 6.0));
    for (int spring = 0; spring < count; ++spring) {
      const auto [one, other] = ends();
      world_.springs.push_back({one, other, random_.inCube(0.1), random_.between(0.0, 0.2),
                                random_.between(0.0, 500.0),
                                chance(0.5) ? 0.0 : random_.between(0.0, 0.5)});
    }
  }
  void addRods() {
    const auto count = static_cast<int>(random_.between(1.0, 5.0));
    for (int rod = 0; rod < count; ++rod) {
      const auto [one, other] = ends();
      world_.rods.push_back({one, other, random_.inCube(0.1) + Vec3(0.001, 0.0, 0.0)});
    }
  }

  SplitMix random_;
  SphereWorld world_;
};

class RandomMechanics : public testing::TestWithParam<int> {};

TEST_P(RandomMechanics, EndsWithBooksInOrderAndNoEnergyFromNowhere) {
  const RandomWorld random(static_cast<std::uint64_t>(GetParam()));
  SphereStepper stepper = stepperOf(random.world());
  const double start = stepper.kineticEnergy() + stepper.potentialEnergy();
  const double size = stepper.kineticEnergy() + 1.0;
  double most = start;
  for (int step = 1; step <= 100; ++step) {
    stepper.advanceTo(0.01 * step);
    ASSERT_TRUE(valid(stepper)) << "at " << 0.01 * step << " s";
    most = std::max(most, stepper.kineticEnergy() + stepper.potentialEnergy());
  }
  if (random.hasEnergyOfItsOwn()) {
    EXPECT_LT(most, start + 1e-3 * size);
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomMechanics, testing::Range(20, 60));

}  // namespace
}  // namespace carom
