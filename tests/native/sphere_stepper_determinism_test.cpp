#include <cinttypes>
#include <cstdio>

#include <gtest/gtest.h>

#include "tests/native/sphere_worlds.h"
#include "tests/native/trajectory_hash.h"

namespace carom {
namespace {

using namespace test;

bool sameBits(const ImpulseEvent& left, const ImpulseEvent& right) {
  return left.time == right.time && left.body == right.body && left.other == right.other &&
         left.impulse == right.impulse && left.position == right.position &&
         left.normal == right.normal && left.approachSpeed == right.approachSpeed &&
         left.bodyPosition == right.bodyPosition && left.bodyVelocity == right.bodyVelocity;
}

TEST(SphereStepperDeterminism, ManySmallStepsGiveTheBitsOfOneBigStep) {
  SphereWorld world = gasInBox(4, 0.95, 11);
  world.gravity = kEarthGravity;
  SphereStepper big = stepperOf(world);
  SphereStepper small = stepperOf(world);
  const auto expected = big.advanceTo(1.0);
  std::vector<ImpulseEvent> events;
  for (int step = 1; step <= 4096; ++step) {
    const auto more = small.advanceTo(step / 4096.0);
    events.insert(events.end(), more.begin(), more.end());
  }
  ASSERT_EQ(events.size(), expected.size());
  ASSERT_GT(events.size(), 500U);
  for (std::size_t event = 0; event < events.size(); ++event) {
    ASSERT_TRUE(sameBits(events[event], expected[event])) << event;
  }
  for (std::size_t sphere = 0; sphere < big.sphereCount(); ++sphere) {
    EXPECT_EQ(small.state(sphere).position, big.state(sphere).position);
  }
}

TEST(SphereStepperDeterminism, ListingOrderOfTheSpheresChangesNoBit) {
  SphereWorld world = gasInBox(3, 0.9, 12);
  world.gravity = kEarthGravity;
  SphereStepper forward = stepperOf(world);
  std::reverse(world.spheres.begin(), world.spheres.end());
  std::reverse(world.planes.begin(), world.planes.end());
  SphereStepper backward = stepperOf(world);
  const auto expected = forward.advanceTo(1.0);
  const auto events = backward.advanceTo(1.0);
  ASSERT_EQ(events.size(), expected.size());
  for (std::size_t event = 0; event < events.size(); ++event) {
    ASSERT_TRUE(sameBits(events[event], expected[event])) << event;
  }
}

constexpr BodyId kFirstBystander = 10'000;

/// Adds a column of spheres high above the others, so many that the stepper uses cells.
SphereWorld withBystanders(SphereWorld world, double radius, double height) {
  for (int place = 0; place < 30; ++place) {
    Sphere bystander = sphereAt(kFirstBystander + static_cast<BodyId>(place),
                                {0.0, height + 2.1 * radius * place, 0.0});
    bystander.radius = radius;
    world.spheres.push_back(bystander);
  }
  return world;
}

bool isBystander(BodyId id) {
  return id >= kFirstBystander && id < kFirstPlane;
}

// Worlds of up to 24 spheres have no cells: each sphere is tested against all others.
TEST(SphereStepperDeterminism, CellsChangeNoBit) {
  for (const Vec3& gravity : {Vec3(0.0, 0.0, 0.0), Vec3(0.5, -9.81, 0.25)}) {
    SphereWorld world = gasInBox(3, 0.97, 13);
    world.spheres.resize(24);
    world.planes.erase(world.planes.begin() + 3);  // open at the top
    world.gravity = gravity;
    SphereStepper alone = stepperOf(world);
    const auto expected = alone.advanceTo(0.5);
    ASSERT_GT(expected.size(), 100U);
    // The columns make levels of large cells, levels of small ones, and a middle that is far away.
    using Kind = std::pair<double, double>;
    for (const auto& [radius, height] : {Kind{0.1, 50.0}, Kind{1e-4, 50.0}, Kind{0.01, 1e9}}) {
      SphereStepper stepper = stepperOf(withBystanders(world, radius, height));
      std::size_t compared = 0;
      for (const ImpulseEvent& event : stepper.advanceTo(0.5)) {
        if (isBystander(event.body) || isBystander(event.other)) continue;
        ASSERT_LT(compared, expected.size());
        ASSERT_TRUE(sameBits(event, expected[compared])) << radius << " " << compared;
        ++compared;
      }
      EXPECT_EQ(compared, expected.size()) << radius;
      EXPECT_TRUE(stepper.validate());
    }
  }
}

TEST(SphereStepperDeterminism, TrajectoryHasTheSameBitsTwiceAndInEveryBuild) {
  const std::uint64_t hash = trajectoryHash();
  EXPECT_EQ(trajectoryHash(), hash);
  char text[17] = {};
  std::snprintf(text, sizeof text, "%016" PRIx64, hash);
  EXPECT_STREQ(text, CAROM_TRAJECTORY_HASH);
}

}  // namespace
}  // namespace carom
