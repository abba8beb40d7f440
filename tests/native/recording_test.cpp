#include "carom/native/recording.h"

#include <bit>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "tests/native/recorded_worlds.h"
#include "tests/native/trajectory_hash.h"

namespace carom {
namespace {

using namespace test;

class Recordings : public testing::TestWithParam<NamedWorld> {};

TEST_P(Recordings, HaveTheBitsOfTheStepperAtEveryTime) {
  const Recording recording = recordedRun(GetParam().world, kRunTime);
  SphereStepper stepper = stepperOf(GetParam().world);
  ASSERT_GE(recording.collisionCount(), 5U);
  for (int step = 0; step <= 1000; ++step) {
    const double time = kRunTime * step / 1000.0;
    stepper.advanceTo(time);
    for (std::size_t sphere = 0; sphere < stepper.sphereCount(); ++sphere) {
      const SphereState expected = stepper.state(sphere);
      const std::size_t index = recording.sphereOf(GetParam().world.spheres[sphere].id).value();
      const SphereState found = recording.state(index, time);
      ASSERT_TRUE(sameBits(found.position, expected.position)) << time;
      ASSERT_TRUE(sameBits(found.velocity, expected.velocity)) << time;
    }
  }
}

TEST_P(Recordings, HaveTheBitsOfAllEvents) {
  const Recording recording = recordedRun(GetParam().world, kRunTime);
  SphereStepper stepper = stepperOf(GetParam().world);
  const auto expected = stepper.advanceTo(kRunTime);
  const std::vector<ImpulseEvent> found = recording.eventsBetween(-1.0, kRunTime);
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t event = 0; event < found.size(); ++event)
    ASSERT_TRUE(sameBits(found[event], expected[event])) << event;
}

TEST_P(Recordings, AreMadeWithoutAnyEffectOnTheRun) {
  SphereStepper recorded = stepperOf(GetParam().world);
  SphereStepper plain = stepperOf(GetParam().world);
  recorded.startRecording();
  const auto found = recorded.advanceTo(kRunTime);
  const auto expected = plain.advanceTo(kRunTime);
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t event = 0; event < found.size(); ++event)
    ASSERT_TRUE(sameBits(found[event], expected[event])) << event;
  EXPECT_EQ(recorded.counters().restContacts, plain.counters().restContacts);
}

TEST_P(Recordings, HoldNoEventThatWouldNotFollowFromItsStates) {
  EXPECT_TRUE(recordedRun(GetParam().world, kRunTime).exceptions().empty());
}

INSTANTIATE_TEST_SUITE_P(Worlds, Recordings, testing::ValuesIn(recordedWorlds()),
                         [](const auto& instance) { return instance.param.name; });

TEST(Recording, IsTheSameHoweverTheRunIsCutIntoSteps) {
  const SphereWorld world = dampedGas();
  SphereStepper stepper = stepperOf(world);
  stepper.startRecording();
  for (int step = 1; step <= 777; ++step)
    stepper.advanceTo(kRunTime * step / 777.0);
  EXPECT_EQ(encodedBytes(stepper.takeRecording()), encodedBytes(recordedRun(world, kRunTime)));
}

TEST(Recording, IsTheSameWhateverTheOrderOfTheList) {
  SphereWorld world = dampedGas();
  const auto bytes = encodedBytes(recordedRun(world, kRunTime));
  std::reverse(world.spheres.begin(), world.spheres.end());
  EXPECT_EQ(encodedBytes(recordedRun(world, kRunTime)), bytes);
}

TEST(Recording, OfALaterPartHasTheBitsOfThatPart) {
  const SphereWorld world = dampedGas();
  const Recording whole = recordedRun(world, kRunTime);
  SphereStepper stepper = stepperOf(world);
  const double begin = 0.4 * kRunTime;
  stepper.advanceTo(begin);
  stepper.startRecording();
  stepper.advanceTo(kRunTime);
  const Recording part = stepper.takeRecording();
  EXPECT_EQ(part.begin(), begin);
  EXPECT_EQ(part.end(), kRunTime);
  for (int step = 0; step <= 50; ++step) {
    const double time = std::min(begin + 0.6 * kRunTime * step / 50.0, kRunTime);
    for (std::size_t sphere = 0; sphere < part.sphereCount(); ++sphere)
      ASSERT_TRUE(sameBits(part.state(sphere, time).position, whole.state(sphere, time).position));
  }
  EXPECT_EQ(part.eventsBetween(begin, kRunTime).size(),
            whole.eventsBetween(begin, kRunTime).size());
  const auto again = redecoded(part);
  EXPECT_EQ(again.trajectoryHash(), part.trajectoryHash());
}

TEST(Recording, FindsTheEventsOfAnIntervalOpenBelowAndClosedAbove) {
  const Recording recording = recordedRun(droppedBall(0.5, 0.8), 2.0);
  const auto all = recording.eventsBetween(-1.0, 2.0);
  ASSERT_GE(all.size(), 6U);
  const double second = all[2].time;
  EXPECT_EQ(recording.collisionsUntil(second), 2U);
  EXPECT_EQ(recording.collisionsUntil(std::nextafter(second, 0.0)), 1U);
  EXPECT_EQ(recording.eventsBetween(second, all[4].time).size(), 2U);
  EXPECT_EQ(recording.eventsBetween(all[0].time, second).size(), 2U);
  EXPECT_TRUE(recording.eventsBetween(2.0, 1.0).empty());
}

// A fall from h takes sqrt(2 h / g); the height on the way is h - g t^2 / 2.
TEST(Recording, OfABouncingBallIsItsParabolas) {
  const double height = 0.5;
  const double gravity = 9.81;
  const Recording recording = recordedRun(droppedBall(height, 1.0), 1.0);
  const double fall = std::sqrt(2.0 * height / gravity);
  ASSERT_GE(recording.segments(0).size(), 2U);
  EXPECT_NEAR(recording.segments(0)[1].since.seconds, fall, 1e-15);
  EXPECT_NEAR(recording.state(0, 0.2).position.y(), 0.05 + height - 0.5 * gravity * 0.04, 1e-15);
  EXPECT_NEAR(recording.state(0, fall + 0.1).velocity.y(), gravity * fall - gravity * 0.1, 1e-13);
}

// Seeking is O(log n) because it is a binary search; the test checks the order that this needs, of
// the segments of each sphere and of the collisions.
TEST(Recording, IsInOrderOfTimeSoThatSeekingIsABinarySearch) {
  const Recording recording = recordedRun(dampedGas(), kRunTime);
  const auto segmentsInOrder = [&](std::size_t sphere) {
    return std::ranges::is_sorted(recording.segments(sphere), {},
                                  [](const auto& segment) { return segment.since.seconds; });
  };
  for (std::size_t sphere = 0; sphere < recording.sphereCount(); ++sphere)
    EXPECT_TRUE(segmentsInOrder(sphere)) << sphere;
  EXPECT_TRUE(std::ranges::is_sorted(recording.collisions(), {},
                                     [](const auto& collision) { return collision.time.seconds; }));
}

TEST(Recording, HasTheTrajectoryHashOfTheRun) {
  for (const HashedRun& run : hashedRuns())
    EXPECT_EQ(recordedRun(run.world, run.duration).trajectoryHash(), runHash(run));
}

// The test compares more than the hash does: an event's record of a box, or of a plane that
// oscillates.
TEST(Recording, HasTheBitsOfAllEventsOfEveryHashedRun) {
  for (const HashedRun& run : hashedRuns()) {
    const Recording recording = recordedRun(run.world, run.duration);
    SphereStepper stepper = stepperOf(run.world);
    const auto expected = stepper.advanceTo(run.duration);
    for (const Recording& each : {recording, redecoded(recording)}) {
      const std::vector<ImpulseEvent> found = each.eventsBetween(-1.0, run.duration);
      ASSERT_EQ(found.size(), expected.size());
      for (std::size_t event = 0; event < found.size(); ++event)
        ASSERT_TRUE(sameBits(found[event], expected[event])) << event;
    }
  }
}

TEST(Recording, OfNothingIsEmpty) {
  SphereStepper stepper = stepperOf(droppedBall(0.5, 0.8));
  stepper.advanceTo(1.0);
  const Recording recording = stepper.takeRecording();
  EXPECT_EQ(recording.sphereCount(), 0U);
  EXPECT_EQ(recording.collisionCount(), 0U);
}

// Later mechanics may record more in an event than follows from the states: it must be kept, too.
TEST(Recording, KeepsWhatAnEventSaysBeyondItsStates) {
  const Recording plain = recordedRun(droppedBall(0.5, 0.8), 1.0);
  ASSERT_GE(plain.collisionCount(), 1U);
  Recording::Events events = plain.events(0);
  events[0].impulse.x() += 0.25;
  events[0].bodyAngularVelocity = {1.0, 2.0, 3.0};
  events[1].hasAppliedImpulse = true;
  events[1].other = 77;
  events[1].otherRadius = 0.0;
  Recording special(plain.world(), 0.0, std::vector{plain.segments(0).front()});
  special.addCollision(events, plain.collisions()[0].time, plain.collisions()[0].impulse);
  special.addSegment(0, plain.segments(0)[1]);
  special.extendTo(1.0);
  for (const Recording& recording : {special, redecoded(special)}) {
    ASSERT_EQ(recording.collisionCount(), 1U);
    EXPECT_TRUE(sameBits(recording.events(0)[0], events[0]));
    EXPECT_TRUE(sameBits(recording.events(0)[1], events[1]));
  }
}

}  // namespace
}  // namespace carom
