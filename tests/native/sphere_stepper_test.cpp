#include "carom/native/sphere_stepper.h"

#include <cmath>
#include <type_traits>

#include <gtest/gtest.h>

#include "tests/native/sphere_worlds.h"
#include "tests/support/constants.h"

namespace carom {
namespace {

using namespace test;

static_assert(std::is_nothrow_move_constructible_v<SphereStepper>);
static_assert(!std::is_copy_constructible_v<SphereStepper>);

Vec3 momentumOf(const SphereStepper& stepper, const SphereWorld& world) {
  Vec3 momentum = Vec3::Zero();
  for (std::size_t sphere = 0; sphere < world.spheres.size(); ++sphere) {
    momentum += world.spheres[sphere].mass * stepper.state(sphere).velocity;
  }
  return momentum;
}

TEST(SphereStepper, EmptyWorldOnlyKeepsTime) {
  SphereStepper stepper = stepperOf({});
  EXPECT_TRUE(stepper.advanceTo(3.0).empty());
  EXPECT_EQ(stepper.time(), 3.0);
  EXPECT_EQ(stepper.sphereCount(), 0U);
  EXPECT_TRUE(valid(stepper));
}

TEST(SphereStepper, FreeFlightIsTheParabola) {
  SphereWorld world = droppedBall(100.0, 1.0);
  world.spheres[0].velocity = {2.0, 3.0, 0.0};
  SphereStepper stepper = stepperOf(world);
  stepper.advanceTo(1.5);
  const SphereState state = stepper.state(0);
  EXPECT_NEAR(state.position.x(), 3.0, 1e-14);
  EXPECT_NEAR(state.position.y(), 100.05 + 4.5 - 0.5 * 9.81 * 2.25, 1e-13);
  EXPECT_NEAR(state.velocity.y(), 3.0 - 9.81 * 1.5, 1e-14);
}

TEST(SphereStepper, MovingItKeepsItsState) {
  SphereStepper first = stepperOf(droppedBall(1.0, 0.8));
  first.advanceTo(1.0);
  const double height = first.state(0).position.y();
  SphereStepper second = std::move(first);
  EXPECT_EQ(second.time(), 1.0);
  EXPECT_EQ(second.state(0).position.y(), height);
}

TEST(SphereStepper, BouncesFollowTheGeometricSeriesUntilRestSpeed) {
  const double e = 0.8;
  const double fall = std::sqrt(2.0 * 1.0 / 9.81);
  const double impactSpeed = std::sqrt(2.0 * 9.81 * 1.0);
  SphereStepper stepper = stepperOf(droppedBall(1.0, e));
  const std::vector<ImpulseEvent> events = eventsUntil(stepper, 20.0);
  // The speed e^k v0 is at least restSpeed for k <= ln(v0 / restSpeed) / ln(1 / e) = 30.4.
  ASSERT_EQ(events.size(), 2U * 31U);
  for (int bounce = 0; bounce < 31; ++bounce) {
    const ImpulseEvent& event = events[2 * static_cast<std::size_t>(bounce)];
    const double power = std::pow(e, bounce);
    const double time = fall * (1.0 + 2.0 * e * (1.0 - power) / (1.0 - e));
    EXPECT_NEAR(event.time, time, 1e-12);
    EXPECT_NEAR(event.approachSpeed, impactSpeed * power, 1e-12);
    EXPECT_NEAR(event.impulse.y(), 1.8 * 0.2 * impactSpeed * power, 1e-12);
  }
  EXPECT_EQ(stepper.counters().restContacts, 1U) << "the next one ends it";
  EXPECT_EQ(stepper.state(0).velocity, Vec3::Zero());
  EXPECT_NEAR(stepper.state(0).position.y(), 0.05, 1e-15);
}

TEST(SphereStepper, BounceIntervalsADayAfterTheStartKeepUnderANanosecond) {
  // A world whose only wall is 60 km away is valid.
  SphereWorld world;
  world.spheres = {sphereAt(1, {0.0, 0.0, 0.0}, {-0.7, 0.0, 0.0})};
  world.planes = {{10, Vec3::UnitX(), -0.7 * 86400.0 - 0.05, 1.0},
                  {11, -Vec3::UnitX(), 0.7 * 86400.0 - 0.35 - 0.05, 1.0}};
  world.planes[1].offset = -(-0.7 * 86400.0 + 0.35 + 0.05);
  world.spheres[0].position.x() = 0.0;
  world.planes.pop_back();
  world.gravity = {-9.81e-6, 0.0, 0.0};
  SphereStepper stepper = stepperOf(world);
  EXPECT_TRUE(valid(stepper));

  // A ball bounces elastically for a whole day: bounce k is at (2 k + 1) falls, without drift.
  SphereStepper ball = stepperOf(droppedBall(5.0, 1.0));
  const double fall = std::sqrt(2.0 * 5.0 / 9.81);
  double worst = 0.0;
  for (double hour = 1.0; hour <= 24.0; hour += 1.0) {
    for (const ImpulseEvent& event : ball.advanceTo(hour * 3600.0)) {
      const double bounce = std::round((event.time / fall - 1.0) / 2.0);
      worst = std::max(worst, std::abs(event.time - (2.0 * bounce + 1.0) * fall));
    }
  }
  EXPECT_LT(worst, 1e-9);
  RecordProperty("worst_drift_ps", static_cast<int>(worst * 1e12));
}

TEST(SphereStepper, TwoBodyCollisionMatchesTheCentreOfMassFrame) {
  SphereWorld world;
  world.spheres = {sphereAt(5, {0.0, 0.0, 0.0}, {2.0, 0.5, 0.0}),
                   sphereAt(3, {1.0, 0.06, 0.0}, {-1.0, 0.5, 0.2})};
  world.spheres[0].mass = 3.0;
  world.spheres[1].restitution = 0.49;  // with 1: e = 0.7
  SphereStepper stepper = stepperOf(world);
  const std::vector<ImpulseEvent> events = eventsUntil(stepper, 1.0);
  ASSERT_EQ(events.size(), 2U);
  // In the frame of the centre of mass both normal velocities reverse, times e.
  const Vec3 n = events[0].normal;
  const Vec3 v1(2.0, 0.5, 0.0);
  const Vec3 v2(-1.0, 0.5, 0.2);
  const Vec3 centre = (3.0 * v1 + 0.2 * v2) / 3.2;
  const Vec3 after1 = v1 - 1.7 * (v1 - centre).dot(n) * n;
  const Vec3 after2 = v2 - 1.7 * (v2 - centre).dot(n) * n;
  EXPECT_LT((stepper.state(0).velocity - after1).norm(), 1e-14);
  EXPECT_LT((stepper.state(1).velocity - after2).norm(), 1e-14);
  EXPECT_NEAR(((events[0].bodyPosition - events[1].bodyPosition).norm()), 0.1, 1e-15);
}

TEST(SphereStepper, EveryFieldOfASphereEventIsFilled) {
  SphereWorld world;
  world.spheres = {sphereAt(9, {0.0, 1.0, 0.0}, {3.0, 0.0, 0.0}), sphereAt(4, {1.0, 1.0, 0.0})};
  world.spheres[1].radius = 0.2;
  world.spheres[1].mass = 0.6;
  SphereStepper stepper = stepperOf(world);
  const std::vector<ImpulseEvent> events = eventsUntil(stepper, 1.0);
  ASSERT_EQ(events.size(), 2U);
  const ImpulseEvent& hit = events[0];  // lower id first
  const ImpulseEvent& hitter = events[1];
  EXPECT_EQ(hit.body, 4U);
  EXPECT_EQ(hit.other, 9U);
  EXPECT_EQ(hitter.body, 9U);
  EXPECT_NEAR(hit.time, 0.25, 1e-15);
  EXPECT_LT((hit.normal - Vec3::UnitX()).norm(), 1e-15);
  EXPECT_LT((hitter.normal + Vec3::UnitX()).norm(), 1e-15);
  EXPECT_LT((hit.position - Vec3(0.8, 1.0, 0.0)).norm(), 1e-15);
  EXPECT_EQ(hit.position, hitter.position);
  EXPECT_NEAR(hit.approachSpeed, 3.0, 1e-15);
  EXPECT_NEAR(hit.effectiveMass, 0.15, 1e-16);
  EXPECT_NEAR(hit.impulse.x(), 0.9, 1e-15);
  EXPECT_EQ(hit.impulse, -hitter.impulse);
  EXPECT_EQ(hit.radius, 0.2);
  EXPECT_EQ(hit.otherRadius, 0.05);
  EXPECT_EQ(hitter.radius, 0.05);
  EXPECT_LT((hitter.bodyPosition - Vec3(0.75, 1.0, 0.0)).norm(), 1e-15);
  EXPECT_EQ(hitter.bodyVelocity, Vec3(3.0, 0.0, 0.0));
  EXPECT_EQ(hit.bodyVelocity, Vec3::Zero());
  EXPECT_EQ(hit.bodyAngularVelocity, Vec3::Zero());
}

TEST(SphereStepper, ThePlaneGetsItsShareWithInfiniteRadius) {
  SphereWorld world = droppedBall(1.0, 0.5);
  world.spheres[0].velocity.x() = 2.0;
  SphereStepper stepper = stepperOf(world);
  const std::vector<ImpulseEvent> events = eventsUntil(stepper, 0.5);
  ASSERT_EQ(events.size(), 2U);
  const ImpulseEvent& plane = events[1];
  EXPECT_EQ(events[0].body, 1U);
  EXPECT_EQ(plane.body, kFirstPlane);
  EXPECT_EQ(plane.other, 1U);
  EXPECT_EQ(plane.impulse, -events[0].impulse);
  EXPECT_EQ(plane.normal, -Vec3::UnitY());
  EXPECT_TRUE(std::isinf(plane.radius));
  EXPECT_EQ(plane.otherRadius, 0.05);
  EXPECT_EQ(plane.effectiveMass, 0.2);
  EXPECT_NEAR(plane.position.y(), 0.0, 1e-15);
  EXPECT_NEAR(plane.position.x(), 2.0 * plane.time, 1e-15);
  EXPECT_EQ(plane.bodyPosition, plane.position);
  EXPECT_EQ(plane.bodyVelocity, Vec3::Zero());
  EXPECT_EQ(events[0].bodyVelocity.x(), 2.0);
}

TEST(SphereStepper, CradlePassesTheVelocityToTheLastBall) {
  for (const double gap : {0.0, 1e-9, 0.01}) {
    const SphereWorld world = cradle(5, gap, 1.5);
    SphereStepper stepper = stepperOf(world);
    EXPECT_EQ(eventsUntil(stepper, 1.0).size(), 8U) << gap;
    for (std::size_t ball = 0; ball < 4; ++ball) {
      EXPECT_LT(stepper.state(ball).velocity.norm(), 1e-12);
    }
    EXPECT_NEAR(stepper.state(4).velocity.x(), 1.5, 1e-12);
  }
}

TEST(SphereStepper, CradleBetweenWallsKeepsItsEnergyOverTenThousandCollisions) {
  SphereWorld world = cradle(5, 0.0, 1.5);
  world.planes = {{100, Vec3::UnitX(), -0.2, 1.0}, {101, -Vec3::UnitX(), -0.6, 1.0}};
  SphereStepper stepper = stepperOf(world);
  const double energy = stepper.kineticEnergy();
  stepper.advanceTo(1000.0);
  EXPECT_GT(stepper.counters().collisions, 10000U);
  EXPECT_NEAR(stepper.kineticEnergy() / energy, 1.0, 1e-12);
  EXPECT_TRUE(valid(stepper));
}

TEST(SphereStepper, GasKeepsEnergyOverAHundredThousandCollisions) {
  SphereWorld world = gasInBox(6, 1.0, 3);
  SphereStepper stepper = stepperOf(world);
  const double energy = stepper.kineticEnergy();
  for (double time = 1.0; stepper.counters().collisions < 100'000; time += 1.0) {
    stepper.advanceTo(time);
    ASSERT_TRUE(valid(stepper));
  }
  EXPECT_NEAR(stepper.kineticEnergy() / energy, 1.0, 1e-12);
  EXPECT_EQ(stepper.counters().restContacts, 0U);
}

/// A slow sphere that bounces tests only near cells. A fast one may come from farther away, over a
/// cell that was near to both all the time.
TEST(SphereStepper, FastSpheresMissNoSlowOneWhereverTheyCrossCells) {
  for (const std::uint64_t seed : {165U, 249U}) {
    SphereWorld world = gasInBox(3, 1.0, seed);
    world.gravity = kEarthGravity;
    for (Sphere& sphere : world.spheres)
      sphere.velocity *= sphere.id % 3 == 0 ? 5.0 : 0.05;
    SphereStepper stepper = stepperOf(world);
    for (int step = 1; step <= 100; ++step) {
      stepper.advanceTo(2e-4 * step);
      ASSERT_TRUE(valid(stepper)) << seed << " " << step;
    }
  }
}

TEST(SphereStepper, MomentumChangesByTheImpulsesOfThePlanesOnly) {
  const SphereWorld world = gasInBox(6, 1.0, 4);
  SphereStepper stepper = stepperOf(world);
  Vec3 expected = momentumOf(stepper, world);
  double scale = 0.0;
  for (const Sphere& sphere : world.spheres)
    scale += sphere.mass * sphere.velocity.norm();
  for (double time = 1.0; stepper.counters().collisions < 100'000; time += 1.0) {
    for (const ImpulseEvent& event : stepper.advanceTo(time)) {
      if (event.body >= kFirstPlane) expected -= event.impulse;
    }
  }
  EXPECT_LT((momentumOf(stepper, world) - expected).norm(), 1e-12 * scale);
}

TEST(SphereStepper, EachSpheresImpulsesAddUpToItsMomentumChange) {
  const SphereWorld world = gasInBox(3, 1.0, 5);
  SphereStepper stepper = stepperOf(world);
  std::vector<Vec3> momentum;
  for (const Sphere& sphere : world.spheres)
    momentum.push_back(sphere.mass * sphere.velocity);
  const std::vector<ImpulseEvent> events = eventsUntil(stepper, 2.0);
  ASSERT_GT(events.size(), 200U);
  for (const ImpulseEvent& event : events) {
    if (event.body < kFirstPlane) momentum[event.body] += event.impulse;
  }
  for (std::size_t sphere = 0; sphere < world.spheres.size(); ++sphere) {
    const Vec3 now = world.spheres[sphere].mass * stepper.state(sphere).velocity;
    EXPECT_LT((now - momentum[sphere]).norm(), 1e-12);
  }
}

TEST(SphereStepper, EventsComeInOrderOfTimeAndInOppositePairs) {
  SphereWorld world = gasInBox(4, 0.9, 6);
  world.gravity = kEarthGravity;
  SphereStepper stepper = stepperOf(world);
  const std::vector<ImpulseEvent> events = eventsUntil(stepper, 1.0);
  ASSERT_EQ(events.size(), 2U * stepper.counters().collisions);
  double last = 0.0;
  for (std::size_t first = 0; first < events.size(); first += 2) {
    EXPECT_GE(events[first].time, last);
    last = events[first].time;
    EXPECT_EQ(events[first].impulse, -events[first + 1].impulse);
    EXPECT_EQ(events[first].body, events[first + 1].other);
    EXPECT_EQ(events[first].other, events[first + 1].body);
    EXPECT_NEAR(events[first].normal.norm(), 1.0, 1e-14);
    EXPECT_GT(events[first].impulse.dot(events[first].normal), 0.0);
    EXPECT_GE(events[first].approachSpeed, world.restSpeed);
  }
}

TEST(SphereStepper, EnergyNeverGrowsWhileItIsLost) {
  for (const double restitution : {0.0, 0.5, 0.9}) {
    SphereWorld world = gasInBox(4, restitution, 8);
    world.gravity = kEarthGravity;
    SphereStepper stepper = stepperOf(world);
    const double start = energyOf(stepper);
    double lowest = start;
    // A hop gives back energy that a plane took before: at most m restSpeed^2 / 8 for each sphere.
    double hops = 0.0;
    for (const Sphere& sphere : world.spheres)
      hops += sphere.mass * 0.125 * 25e-6;
    for (int step = 1; step <= 120; ++step) {
      stepper.advanceTo(0.01 * step);
      EXPECT_LE(energyOf(stepper), lowest + hops + 1e-12 * start);
      lowest = std::min(lowest, energyOf(stepper));
      ASSERT_TRUE(valid(stepper));
    }
    EXPECT_LT(lowest, start - 0.1 * std::abs(start));
  }
}

TEST(SphereStepper, ABallPlacedOnTheFloorStaysSilentAndWhereItIs) {
  SphereStepper stepper = stepperOf(droppedBall(0.0, 0.7));
  EXPECT_TRUE(eventsUntil(stepper, 10.0).empty());
  EXPECT_EQ(stepper.state(0).position.y(), 0.05);
  EXPECT_EQ(stepper.counters().restContacts, 1U);
}

TEST(SphereStepper, ABallPlacedOnTheFloorWithRoundingStaysToo) {
  for (const double error : {-1e-12, -1e-17, 1e-17, 1e-13, 1e-9}) {
    SphereStepper stepper = stepperOf(droppedBall(error, 0.7));
    EXPECT_TRUE(eventsUntil(stepper, 1.0).empty()) << error;
    EXPECT_LE(stepper.counters().restContacts, 2U) << error;
  }
}

TEST(SphereStepper, ALevelSlideAlongAWallDoesNotLeaveIt) {
  SphereWorld world = droppedBall(0.0, 0.7);
  world.planes.push_back({kFirstPlane + 1, Vec3::UnitX(), -0.05, 1.0});
  world.gravity = {-6e-16, -9.81, 0.0};  // level but for rounding
  world.spheres[0].velocity = {0.0, 0.0, 1.0};
  SphereStepper stepper = stepperOf(world);
  EXPECT_TRUE(eventsUntil(stepper, 1.0).empty());
  EXPECT_NEAR(stepper.state(0).position.x(), 0.0, 1e-12);
  EXPECT_NEAR(stepper.state(0).position.z(), 1.0, 1e-12);
}

TEST(SphereStepper, PlasticStackOnAPlaneDoesNotHang) {
  for (const double restSpeed : {0.005, 0.0}) {
    SphereWorld world = droppedBall(0.5, 0.0);
    world.restSpeed = restSpeed;
    for (BodyId ball = 2; ball <= 5; ++ball) {
      Sphere sphere = world.spheres[0];
      sphere.id = ball;
      sphere.position.y() += 0.1 * (ball - 1);
      world.spheres.push_back(sphere);
    }
    SphereStepper stepper = stepperOf(world);
    stepper.advanceTo(1.5);
    EXPECT_TRUE(valid(stepper));
    EXPECT_LT(stepper.kineticEnergy(), 1e-4) << restSpeed;
    EXPECT_NEAR(stepper.state(4).position.y(), 0.45, 1e-4) << restSpeed;
  }
}

TEST(SphereStepper, InelasticCollapseWithoutRestSpeedEndsAndIsCounted) {
  SphereWorld world = droppedBall(1.0, 0.5);
  world.restSpeed = 0.0;
  SphereStepper stepper = stepperOf(world);
  const std::vector<ImpulseEvent> events = eventsUntil(stepper, 3.0);
  const double end = std::sqrt(2.0 / 9.81) * 3.0;  // sum of the series for e = 1/2
  // A bounce that would last less than 10 us does not occur: v0 / 2^k < g 5 us from k = 17 on.
  ASSERT_EQ(events.size(), 2U * 17U);
  EXPECT_NEAR(events.back().time, end, 2e-5);
  EXPECT_EQ(stepper.state(0).velocity, Vec3::Zero());
}

TEST(SphereStepper, InelasticCollapseBetweenThreeBallsEnds) {
  SphereWorld world = cradle(3, 0.01, 1.0);
  world.restSpeed = 0.0;
  world.spheres[2].velocity.x() = -1.0;
  for (Sphere& sphere : world.spheres)
    sphere.restitution = 0.05;  // below 7 - 4 sqrt(3) = 0.072
  SphereStepper stepper = stepperOf(world);
  stepper.advanceTo(10.0);
  EXPECT_TRUE(valid(stepper));
}

TEST(SphereStepper, BallsRestingSideBySideInAVeeStayQuiet) {
  SphereWorld world;
  world.gravity = kEarthGravity;
  const double s = std::sqrt(0.5);
  world.planes = {{100, {s, s, 0.0}, 0.0, 0.6}, {101, {-s, s, 0.0}, 0.0, 0.6}};
  world.spheres = {sphereAt(1, {0.0, 0.05 / s, 0.0}), sphereAt(2, {0.0, 0.05 / s, 0.1})};
  SphereStepper stepper = stepperOf(world);
  EXPECT_TRUE(eventsUntil(stepper, 2.0).empty());
  EXPECT_NEAR(stepper.state(0).position.y(), 0.05 / s, 1e-14);
  EXPECT_LE(stepper.counters().restContacts, 8U);
}

TEST(SphereStepper, MassRatioOfABillionReflectsTheLightBallAtTwiceTheSpeed) {
  SphereWorld world = cradle(2, 0.5, 1.0);
  world.spheres[0].mass = 1e6;
  world.spheres[1].mass = 1e-3;
  SphereStepper stepper = stepperOf(world);
  const double energy = stepper.kineticEnergy();
  eventsUntil(stepper, 1.0);
  EXPECT_NEAR(stepper.state(1).velocity.x(), 2.0 / (1.0 + 1e-9), 1e-14);
  EXPECT_NEAR(stepper.kineticEnergy() / energy, 1.0, 1e-15);
}

TEST(SphereStepper, RadiusRatioOfTenThousandBouncesAtTheRightTime) {
  SphereWorld world = cradle(2, 0.0, 0.0);
  world.spheres[0].radius = 10.0;
  world.spheres[1].radius = 0.001;
  world.spheres[1].position.x() = 10.501;
  world.spheres[1].velocity.x() = -2.0;
  SphereStepper stepper = stepperOf(world);
  const std::vector<ImpulseEvent> events = eventsUntil(stepper, 1.0);
  ASSERT_EQ(events.size(), 2U);
  EXPECT_NEAR(events[0].time, 0.25, 1e-14);
  EXPECT_NEAR(events[0].position.x(), 10.0, 1e-14);
}

TEST(SphereStepper, GrazingWithinOnePartInTenToTheTwelveHitsOrMissesAsItShould) {
  for (const double offset : {0.1 * (1.0 - 1e-12), 0.1 * (1.0 + 1e-12)}) {
    SphereWorld world = cradle(2, 1.0, 1.0);
    world.restSpeed = 0.0;
    world.spheres[1].position.y() = offset;
    SphereStepper stepper = stepperOf(world);
    const bool hits = offset < 0.1;
    EXPECT_EQ(eventsUntil(stepper, 3.0).size(), hits ? 2U : 0U);
    EXPECT_NEAR(stepper.state(0).velocity.x(), 1.0, 1e-11);
  }
}

TEST(SphereStepper, SpeedsOfANanometreAndTenKilometresPerSecondWork) {
  for (const double speed : {1e-9, 1e4}) {
    SphereWorld world = cradle(2, 0.5, speed);
    world.restSpeed = 0.0;
    SphereStepper stepper = stepperOf(world);
    const std::vector<ImpulseEvent> events = eventsUntil(stepper, 1.0 / speed);
    ASSERT_EQ(events.size(), 2U);
    EXPECT_NEAR(events[0].time * speed, 0.5, 1e-14);
    EXPECT_NEAR(stepper.state(1).velocity.x() / speed, 1.0, 1e-14);
  }
}

TEST(SphereStepper, TouchingAndApproachingAtTheStartCollidesAtTimeZero) {
  SphereWorld world = cradle(2, 0.0, 1.0);
  SphereStepper stepper = stepperOf(world);
  const std::vector<ImpulseEvent> events = eventsUntil(stepper, 0.0);
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0].time, 0.0);
}

TEST(SphereStepper, TouchingAndSeparatingAtTheStartNeverCollides) {
  SphereStepper stepper = stepperOf(cradle(2, 0.0, -1.0));
  EXPECT_TRUE(eventsUntil(stepper, 10.0).empty());
}

// ---- create

class SphereStepperRefuses : public ::testing::TestWithParam<Refusal> {};

TEST_P(SphereStepperRefuses, WithAMessageThatSaysWhatAndWhere) {
  SphereWorld world = droppedBall(1.0, 0.5);
  world.spheres.push_back(sphereAt(2, {1.0, 1.0, 0.0}));
  GetParam().spoil(world);
  const Result<SphereStepper> stepper = SphereStepper::create(world);
  ASSERT_FALSE(stepper);
  EXPECT_NE(stepper.error().message.find(GetParam().message), std::string::npos)
      << stepper.error().message;
}

constexpr double kInfinite = std::numeric_limits<double>::infinity();

INSTANTIATE_TEST_SUITE_P(
    All, SphereStepperRefuses,
    ::testing::Values(
        Refusal{"ZeroRadius", [](SphereWorld& w) { w.spheres[1].radius = 0.0; },
                "sphere 2: radius is 0 m; it must be finite and above 0"},
        Refusal{"InfiniteRadius", [](SphereWorld& w) { w.spheres[0].radius = kInfinite; },
                "sphere 1: radius is inf"},
        Refusal{"NegativeMass", [](SphereWorld& w) { w.spheres[0].mass = -1.0; },
                "sphere 1: mass is -1 kg"},
        Refusal{"RestitutionAboveOne", [](SphereWorld& w) { w.spheres[0].restitution = 1.5; },
                "sphere 1: restitution is 1.5; it must be between 0 and 1"},
        Refusal{"RestitutionNan", [](SphereWorld& w) { w.planes[0].restitution = kNaN; },
                "plane 1000000: restitution is nan"},
        Refusal{"PositionNan", [](SphereWorld& w) { w.spheres[0].position.z() = kNaN; },
                "sphere 1: position is (0, "},
        Refusal{"VelocityInfinite", [](SphereWorld& w) { w.spheres[0].velocity.x() = kInfinite; },
                "sphere 1: velocity is (inf, 0, 0)"},
        Refusal{"NormalTooLong", [](SphereWorld& w) { w.planes[0].normal *= 2.0; },
                "plane 1000000: normal has length 2; it must be 1"},
        Refusal{"NormalNan", [](SphereWorld& w) { w.planes[0].normal.x() = kNaN; },
                "plane 1000000: normal is (nan"},
        Refusal{"OffsetInfinite", [](SphereWorld& w) { w.planes[0].offset = -kInfinite; },
                "plane 1000000: offset is -inf"},
        Refusal{"SameIds", [](SphereWorld& w) { w.spheres[1].id = 1; }, "id 1 is used twice"},
        Refusal{"SphereHasThePlanesId", [](SphereWorld& w) { w.spheres[1].id = kFirstPlane; },
                "id 1000000 is used twice"},
        Refusal{"OverlappingSpheres",
                [](SphereWorld& w) {
                  w.spheres[1].position = {0.0999, 1.05, 0.0};
                },
                "sphere 1: overlaps sphere 2 by"},
        Refusal{"SphereInThePlane", [](SphereWorld& w) { w.spheres[1].position.y() = 0.04; },
                "sphere 2: overlaps plane 1000000 by"},
        Refusal{"NegativeRestSpeed", [](SphereWorld& w) { w.restSpeed = -0.1; },
                "restSpeed is -0.1"},
        Refusal{"GravityNan", [](SphereWorld& w) { w.gravity.x() = kNaN; },
                "world: gravity is (nan"}),
    [](const auto& refusal) { return std::string(refusal.param.name); });

TEST(SphereStepper, AcceptsOverlapsOfABillionthAndNormalsWithinRounding) {
  SphereWorld world = cradle(2, -0.9e-9 * 0.05, 1.0);
  world.planes = {{100, Vec3::UnitY() * (1.0 + 0.9e-9), -1.0, 1.0}};
  SphereStepper stepper = stepperOf(world);
  EXPECT_EQ(eventsUntil(stepper, 1.0).size(), 2U);
}

#ifdef NDEBUG
TEST(SphereStepper, GoingBackInTimeMovesNothing) {
  SphereStepper stepper = stepperOf(droppedBall(1.0, 0.5));
  stepper.advanceTo(2.0);
  EXPECT_TRUE(stepper.advanceTo(1.0).empty());
  EXPECT_TRUE(stepper.advanceTo(kNaN).empty());
  EXPECT_TRUE(stepper.advanceTo(kInfinite).empty());
  EXPECT_EQ(stepper.time(), 2.0);
}
#else
TEST(SphereStepperDeathTest, GoingBackInTimeIsAsserted) {
  SphereStepper stepper = stepperOf(droppedBall(1.0, 0.5));
  stepper.advanceTo(2.0);
  EXPECT_DEATH(stepper.advanceTo(1.0), "not before time");
}
#endif

TEST(SphereStepper, APushIsAnImpulseAndNoCollision) {
  SphereWorld world;
  world.spheres = {sphereAt(1, {0.0, 1.0, 0.0}, {1.0, 0.0, 0.0}), sphereAt(2, {0.0, 2.0, 0.0})};
  SphereStepper stepper = *SphereStepper::create(world);
  stepper.advanceTo(0.5);
  stepper.push(0, {0.1, 0.0, -0.2});
  EXPECT_TRUE(stepper.advanceTo(1.5).empty());
  // The sphere's mass is 0.2 kg.
  EXPECT_LT((stepper.state(0).position - Vec3(0.5 + 1.5, 1.0, -1.0)).norm(), 1e-12);
  EXPECT_EQ(stepper.state(1).position, Vec3(0.0, 2.0, 0.0));
  EXPECT_TRUE(valid(stepper));
}

TEST(SphereStepper, APushBringsACollisionForward) {
  SphereWorld world;
  world.spheres = {sphereAt(1, Vec3::Zero(), {1.0, 0.0, 0.0}), sphereAt(2, {1.1, 0.0, 0.0})};
  SphereStepper stepper = *SphereStepper::create(world);
  stepper.advanceTo(0.5);
  stepper.push(0, {0.2, 0.0, 0.0});  // to 2 m/s, with 0.5 m to go
  const auto events = stepper.advanceTo(2.0);
  ASSERT_EQ(events.size(), 2U);
  EXPECT_NEAR(events[0].time, 0.75, 1e-12);
  EXPECT_NEAR(events[0].impulse.norm(), 0.4, 1e-12);
}

TEST(SphereStepper, APushOntoTheFloorSinksNothing) {
  SphereWorld world;
  world.gravity = kEarthGravity;
  world.restSpeed = 0.005;
  world.spheres = {sphereAt(1, {0.0, 0.06, 0.0})};
  world.spheres.front().restitution = 0.3;
  world.planes = {floorPlane(0.3)};
  SphereStepper stepper = *SphereStepper::create(world);
  stepper.advanceTo(2.0);
  for (int step = 1; step <= 1000; ++step) {  // pushes a little aside, too
    stepper.push(0, {1e-5, -1e-3, 0.0});
    stepper.advanceTo(2.0 + 1e-3 * step);
    ASSERT_NEAR(stepper.state(0).position.y(), 0.05, 1e-6) << step;
  }
  EXPECT_NEAR(stepper.state(0).velocity.x(), 1000 * 1e-5 / 0.2, 1e-9);
  EXPECT_TRUE(valid(stepper));
}

TEST(SphereStepper, APushWakesWhatSleeps) {
  SphereWorld world;
  world.gravity = kEarthGravity;
  world.restSpeed = 0.005;
  world.planes = boxOf(0.12, 0.3);
  for (BodyId id = 1; id <= 8; ++id) {  // two layers, the upper one not quite above the lower
    const double off = id > 4 ? 0.01 : 0.0;
    world.spheres.push_back(
        sphereAt(id, {(id % 2 == 0 ? 0.055 : -0.055) + off, id > 4 ? 0.06 : -0.06,
                      (id % 4 < 2 ? 0.055 : -0.055) - off}));
    world.spheres.back().restitution = 0.3;
  }
  SphereStepper stepper = *SphereStepper::create(world);
  stepper.advanceTo(6.0);
  const auto asleep = [&] { return stepper.counters().putToSleep - stepper.counters().woken; };
  ASSERT_EQ(asleep(), 8U);
  const Vec3 before = stepper.state(7).position;
  stepper.push(7, {0.0, 0.1, 0.0});
  EXPECT_LT(asleep(), 8U);  // the sphere and those that leaned on it
  stepper.advanceTo(6.05);
  EXPECT_GT(stepper.state(7).position.y() - before.y(), 0.012);  // free flight: 0.0127
}

}  // namespace
}  // namespace carom
