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

TEST(SphereStepperDeterminism, TrajectoryHasTheSameBitsTwiceAndInEveryBuild) {
  const std::uint64_t hash = trajectoryHash();
  EXPECT_EQ(trajectoryHash(), hash);
  char text[17] = {};
  std::snprintf(text, sizeof text, "%016" PRIx64, hash);
  EXPECT_STREQ(text, CAROM_TRAJECTORY_HASH);
}

}  // namespace
}  // namespace carom
