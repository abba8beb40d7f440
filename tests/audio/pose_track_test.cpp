#include "audio/propagation/pose_track.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/constants.h"
#include "tests/support/no_alloc_scope.h"

namespace carom {

using namespace audio;

namespace {

using namespace test;

constexpr double kSpeedOfSound = 343.0;

ListenerPose poseAt(double time, const Vec3& position) {
  return {time, position, Quat::Identity()};
}

/// A track with a pose every `step` s along start + velocity * t.
PoseTrack straight(const Vec3& start, const Vec3& velocity, double step, int poses) {
  PoseTrack track(poseAt(0.0, start));
  for (int pose = 1; pose <= poses; ++pose)
    EXPECT_TRUE(track.append(poseAt(pose * step, start + pose * step * velocity)));
  return track;
}

/// The delay (s): the positive root of |x0 + v t - x_S|^2 = c^2 (t - t_e)^2.
double straightDelay(const Vec3& start, const Vec3& velocity, double emission, const Vec3& source) {
  const Vec3 path = start + emission * velocity - source;
  const double a = kSpeedOfSound * kSpeedOfSound - velocity.squaredNorm();
  const double b = path.dot(velocity);
  return (b + std::sqrt(b * b + a * path.squaredNorm())) / a;
}

TEST(PoseTrack, StandingListenerHearsAfterDistanceOverSpeed) {
  const PoseTrack track(poseAt(0.0, Vec3(3.0, 4.0, 0.0)));
  const Arrival arrival = arrivalOf(track, {2.0, Vec3::Zero(), Vec3::Zero()}, kSpeedOfSound);
  EXPECT_EQ(arrival.delay, 5.0 / kSpeedOfSound);
  EXPECT_EQ(arrival.time, 2.0 + 5.0 / kSpeedOfSound);
  EXPECT_EQ(arrival.distance, 5.0);
  EXPECT_EQ(arrival.stretch, 1.0);
  EXPECT_TRUE(arrival.towardsSource.isApprox(Vec3(-0.6, -0.8, 0.0)));
  EXPECT_EQ(arrivalTime(track, 2.0, Vec3::Zero(), kSpeedOfSound), arrival.time);
}

// A listener who walks, stops and walks on: the arrival solves its equation wherever it falls.
TEST(PoseTrack, ListenerWhoStopsAndWalksOnHearsAtTheRoot) {
  PoseTrack track(poseAt(0.0, Vec3(5.0, 0.0, 0.0)));
  const Vec3 ear(0.0, 0.1, 0.0);
  const Vec3 source(1.0, 2.0, 0.5);
  const auto expectRoot = [&](double emission) {
    const Arrival arrival = arrivalOf(track, {emission, source, Vec3::Zero()}, kSpeedOfSound, ear);
    const double distance = (track.motion(arrival.time, ear).position - source).norm();
    EXPECT_NEAR(arrival.delay, distance / kSpeedOfSound, 1e-12) << emission;
    EXPECT_NEAR(arrival.distance, distance, 1e-12) << emission;
  };
  double x = 5.0;
  for (int pose = 1; pose <= 60; ++pose) {
    if (pose <= 20 || pose > 40) x += 0.05;
    ASSERT_TRUE(track.append(poseAt(pose / 20.0, Vec3(x, 0.0, 0.0))));
    EXPECT_EQ(track.stands(pose / 20.0), pose > 20 && pose <= 40) << pose;
    for (const double emission : {0.0, 0.7, 1.0, 1.02, 1.05, 1.5, 1.99, 2.0, 2.5})
      expectRoot(emission);
  }
}

TEST(PoseTrack, SourceAtTheListenerIsHeardAtOnce) {
  const PoseTrack track(poseAt(0.0, Vec3(1.0, 1.0, 1.0)));
  const Arrival arrival =
      arrivalOf(track, {0.5, Vec3(1.0, 1.0, 1.0), Vec3(9.0, 0.0, 0.0)}, kSpeedOfSound);
  EXPECT_EQ(arrival.delay, 0.0);
  EXPECT_EQ(arrival.stretch, 1.0);
  EXPECT_EQ(arrival.towardsSource, Vec3::Zero());
}

TEST(PoseTrack, ConstantVelocityArrivesAtTheRootOfTheQuadratic) {
  const Vec3 start(-20.0, 3.0, 1.0);
  for (const Vec3& velocity :
       {Vec3(1.5, 0.0, 0.0), Vec3(-30.0, 20.0, 5.0), Vec3(170.0, 0.0, 0.0)}) {
    const PoseTrack track = straight(start, velocity, 1.0 / 60.0, 120);
    for (double emission = 0.0; emission < 1.5; emission += 0.037) {
      const Vec3 source(1.0, 2.0, -3.0);
      const double expected = straightDelay(start, velocity, emission, source);
      if (emission + expected > 1.9) continue;
      const Arrival arrival = arrivalOf(track, {emission, source, Vec3::Zero()}, kSpeedOfSound);
      EXPECT_NEAR(arrival.delay, expected, 1e-12);
      EXPECT_NEAR(arrival.distance, kSpeedOfSound * expected, 1e-9);
    }
  }
}

// On one line f' / f = (c - v_L) / (c - v_S); v points towards +x, and the source is behind the
// listener.
TEST(PoseTrack, DopplerRatioOfBothOnOneLine) {
  for (const double listenerSpeed : {-40.0, 0.0, 25.0}) {
    for (const double sourceSpeed : {-60.0, 0.0, 80.0}) {
      const PoseTrack track =
          straight(Vec3(30.0, 0.0, 0.0), Vec3(listenerSpeed, 0.0, 0.0), 0.01, 50);
      const Arrival arrival =
          arrivalOf(track, {0.1, Vec3::Zero(), Vec3(sourceSpeed, 0.0, 0.0)}, kSpeedOfSound);
      EXPECT_NEAR(1.0 / arrival.stretch,
                  (kSpeedOfSound - listenerSpeed) / (kSpeedOfSound - sourceSpeed), 1e-12);
    }
  }
}

TEST(PoseTrack, StretchIsTheSlopeOfTheArrivalTime) {
  PoseTrack track(poseAt(0.0, Vec3(5.0, 0.0, 0.0)));
  for (int pose = 1; pose <= 200; ++pose) {
    const double time = pose * 0.01;
    ListenerPose next =
        poseAt(time, Vec3(5.0 * std::cos(4.0 * time), 5.0 * std::sin(4.0 * time), 0.0));
    next.orientation = Quat(Eigen::AngleAxisd(10.0 * time, Vec3::UnitY()));
    ASSERT_TRUE(track.append(next));
  }
  const Vec3 start(2.0, 1.0, 0.5);
  const Vec3 velocity(-7.0, 3.0, 11.0);
  const Vec3 offset(0.3, 0.0, 0.1);
  const double half = 1e-5;
  for (double emission = 0.303; emission < 1.5; emission += 0.1) {
    const auto at = [&](double time) {
      return arrivalOf(track, {time, start + time * velocity, velocity}, kSpeedOfSound, offset);
    };
    const double slope =
        1.0 + (at(emission + half).delay - at(emission - half).delay) / (2.0 * half);
    EXPECT_NEAR(at(emission).stretch, slope, 1e-7);
  }
}

// A listener on a circle around the source stays at the same distance: the delay is r / c, the
// ratio 1.
TEST(PoseTrack, CircleAroundTheSourceKeepsTheDelay) {
  const double radius = 2.0;
  PoseTrack track(poseAt(0.0, Vec3(radius, 0.0, 0.0)));
  const double step = 1e-3;
  const double rate = 5.0;
  for (int pose = 1; pose <= 1000; ++pose)
    ASSERT_TRUE(
        track.append(poseAt(pose * step, radius * Vec3(std::cos(rate * pose * step),
                                                       std::sin(rate * pose * step), 0.0))));
  const double acceleration = rate * rate * radius;
  for (double emission = 0.1; emission < 0.9; emission += 0.0137) {
    const Arrival arrival = arrivalOf(track, {emission, Vec3::Zero(), Vec3::Zero()}, kSpeedOfSound);
    EXPECT_NEAR(arrival.distance, radius, 0.05 * acceleration * step * step);
    EXPECT_NEAR(arrival.delay, radius / kSpeedOfSound, 1e-8);
    EXPECT_NEAR(arrival.stretch, 1.0, acceleration * step / 2.0 / kSpeedOfSound);
  }
}

TEST(PoseTrack, UniformAccelerationStaysWithinTheStatedError) {
  const double acceleration = 8.0;
  const double step = 1.0 / 60.0;
  const auto truth = [&](double time) { return 0.5 * acceleration * time * time; };
  PoseTrack track(poseAt(0.0, Vec3::Zero()));
  for (int pose = 1; pose <= 60; ++pose)
    ASSERT_TRUE(track.append(poseAt(pose * step, Vec3(truth(pose * step), 0.0, 0.0))));
  double worst = 0.0;
  double worstVelocity = 0.0;
  for (double time = 0.1; time < 0.99; time += 0.00037) {
    const PoseTrack::Motion motion = track.motion(time);
    worst = std::max(worst, std::abs(motion.position.x() - truth(time)));
    worstVelocity = std::max(worstVelocity, std::abs(motion.velocity.x() - acceleration * time));
  }
  EXPECT_LT(worst, 0.0485 * acceleration * step * step);
  EXPECT_GT(worst, 0.045 * acceleration * step * step);
  EXPECT_LE(worstVelocity, 0.5 * acceleration * step * (1.0 + 1e-9));
}

/// A path with stops, turns and uneven intervals.
PoseTrack restless() {
  PoseTrack track(poseAt(0.0, Vec3::Zero()));
  const std::vector<double> steps = {0.01, 0.03, 0.005, 0.02, 0.02, 0.04, 0.01};
  double time = 0.0;
  for (int pose = 1; pose <= 70; ++pose) {
    time += steps[static_cast<std::size_t>(pose) % steps.size()];
    const double x = pose % 5 == 0 ? 0.3 : std::sin(0.7 * pose);
    ListenerPose next = poseAt(time, 0.2 * Vec3(x, std::cos(1.3 * pose), 0.01 * pose));
    next.orientation = Quat(Eigen::AngleAxisd(0.8 * std::sin(pose), Vec3(0.6, 0.8, 0.0)));
    EXPECT_TRUE(track.append(next));
  }
  return track;
}

TEST(PoseTrack, PositionAndVelocityAreContinuousAndTheSpeedIsBounded) {
  const PoseTrack track = restless();
  PoseTrack::Motion before = track.motion(0.001);
  Quat orientation = track.at(0.001).orientation;
  const double step = 1e-6;
  for (double time = 0.001; time < 0.8; time += step) {
    const PoseTrack::Motion now = track.motion(time);
    ASSERT_LT((now.position - before.position).norm(), 1000.0 * step);
    ASSERT_LT((now.velocity - before.velocity).norm(), 1e6 * step);
    ASSERT_LT(now.velocity.norm(), PoseTrack::kMaxSpeed * 5.0 / 3.0);
    before = now;
    const Quat turned = track.at(time).orientation;
    ASSERT_LT(turned.angularDistance(orientation), 1000.0 * step);
    orientation = turned;
  }
}

TEST(PoseTrack, AppendedPosesDoNotChangeWhatIsBeforeTheLast) {
  PoseTrack track = straight(Vec3::Zero(), Vec3(2.0, 0.0, 0.0), 0.1, 5);
  std::vector<Vec3> before;
  for (double time = -0.1; time <= 0.5; time += 0.01)
    before.push_back(track.motion(time).position);
  ASSERT_TRUE(track.append(poseAt(0.6, Vec3(-4.0, 7.0, 0.0))));
  std::size_t index = 0;
  for (double time = -0.1; time <= 0.5; time += 0.01)
    EXPECT_EQ(track.motion(time).position, before[index++]);
}

TEST(PoseTrack, PassesThroughItsPoses) {
  PoseTrack track(poseAt(0.0, Vec3::Zero()));
  ListenerPose second = poseAt(0.1, Vec3(1.0, 2.0, 3.0));
  second.orientation = Quat(Eigen::AngleAxisd(1.0, Vec3::UnitY()));
  ASSERT_TRUE(track.append(second));
  ASSERT_TRUE(track.append(poseAt(0.2, Vec3(1.0, 0.0, 3.0))));
  EXPECT_TRUE(track.at(0.1).position.isApprox(second.position));
  EXPECT_NEAR(track.at(0.1).orientation.angularDistance(second.orientation), 0.0, 1e-12);
  // Slerp gives half of the angle at half of the time.
  const Quat half(Eigen::AngleAxisd(0.5, Vec3::UnitY()));
  EXPECT_NEAR(track.at(0.05).orientation.angularDistance(half), 0.0, 1e-12);
}

TEST(PoseTrack, TakesTheShorterWayAround) {
  PoseTrack track(poseAt(0.0, Vec3::Zero()));
  ListenerPose second = poseAt(1.0, Vec3::Zero());
  second.orientation.coeffs() = -Quat(Eigen::AngleAxisd(0.2, Vec3::UnitX())).coeffs();
  ASSERT_TRUE(track.append(second));
  const Quat half(Eigen::AngleAxisd(0.1, Vec3::UnitX()));
  EXPECT_NEAR(track.at(0.5).orientation.angularDistance(half), 0.0, 1e-12);
}

TEST(PoseTrack, GoesOnForTheHorizonAndThenStands) {
  const PoseTrack track = straight(Vec3::Zero(), Vec3(2.0, 0.0, 0.0), 0.1, 5);
  EXPECT_EQ(track.at(-3.0).position, Vec3::Zero());
  EXPECT_NEAR(track.motion(0.55).position.x(), 1.1, 1e-12);
  EXPECT_NEAR(track.motion(0.55).velocity.x(), 2.0, 1e-12);
  EXPECT_NEAR(track.motion(0.60).position.x(), 1.2, 1e-12);
  EXPECT_NEAR(track.motion(1e6).position.x(), 1.2, 1e-12);
  EXPECT_EQ(track.motion(1e6).velocity, Vec3::Zero());
}

TEST(PoseTrack, RefusesWhatIsNoNextPose) {
  PoseTrack track = straight(Vec3::Zero(), Vec3(1.0, 0.0, 0.0), 0.1, 3);
  EXPECT_FALSE(track.append(poseAt(0.3, Vec3::Zero())));
  EXPECT_FALSE(track.append(poseAt(0.2, Vec3::Zero())));
  EXPECT_FALSE(track.append(poseAt(kNaN, Vec3::Zero())));
  EXPECT_FALSE(track.append(poseAt(0.4, Vec3(kNaN, 0.0, 0.0))));
  EXPECT_FALSE(track.append(poseAt(0.4, Vec3(100.0, 0.0, 0.0))));
  ListenerPose notUnit = poseAt(0.4, Vec3(0.4, 0.0, 0.0));
  notUnit.orientation = Quat(2.0, 0.0, 0.0, 0.0);
  EXPECT_FALSE(track.append(notUnit));
  EXPECT_EQ(track.size(), 4u);
  EXPECT_TRUE(track.restart(poseAt(0.4, Vec3(100.0, 0.0, 0.0))));
  EXPECT_EQ(track.size(), 1u);
  EXPECT_EQ(track.at(0.1).position.x(), 100.0);
}

TEST(PoseTrack, ForgettingChangesNothingFromThenOn) {
  const PoseTrack whole = restless();
  PoseTrack pruned = whole;
  pruned.forgetBefore(0.5);
  EXPECT_LT(pruned.size(), whole.size());
  for (double time = 0.5; time < 2.0; time += 0.0031)
    EXPECT_EQ(pruned.motion(time).position, whole.motion(time).position);
  pruned.forgetBefore(1e9);
  EXPECT_EQ(pruned.size(), 1u);
  EXPECT_EQ(pruned.motion(5.0).position, whole.motion(5.0).position);
}

TEST(PoseTrack, MemoryIsBoundedAndTheLossIsCounted) {
  PoseTrack track(poseAt(0.0, Vec3::Zero()), {16, 0.1});
  const test::NoAllocScope scope;
  for (int pose = 1; pose <= 100; ++pose)
    track.append(poseAt(pose * 0.01, Vec3(0.01 * pose, 0.0, 0.0)));
  arrivalTime(track, 0.9, Vec3(3.0, 0.0, 0.0), kSpeedOfSound);
  EXPECT_EQ(scope.allocations(), 0u);
  EXPECT_EQ(track.size(), 16u);
  EXPECT_EQ(track.droppedPoses(), 85u);
  EXPECT_NEAR(track.motion(0.995).position.x(), 0.995, 1e-12);
}

TEST(PoseTrack, DelayKeepsItsDigitsAfterADay) {
  const double day = 86400.0;
  PoseTrack track(poseAt(day, Vec3(10.0, 0.0, 0.0)));
  ASSERT_TRUE(track.append(poseAt(day + 1.0, Vec3(15.0, 0.0, 0.0))));
  const Arrival arrival = arrivalOf(track, {day, Vec3::Zero(), Vec3::Zero()}, kSpeedOfSound);
  EXPECT_NEAR(arrival.delay, 10.0 / (kSpeedOfSound - 5.0), 1e-12);
}

TEST(PoseTrack, AListenerFasterThanSoundIsStillReached) {
  const double slowSound = 20.0;
  const PoseTrack track = straight(Vec3(1.0, 0.0, 0.0), Vec3(100.0, 0.0, 0.0), 0.01, 20);
  const Arrival arrival = arrivalOf(track, {0.0, Vec3::Zero(), Vec3::Zero()}, slowSound);
  EXPECT_NEAR(arrival.delay, arrival.distance / slowSound, 1e-9);
  EXPECT_NEAR(arrival.distance, 31.0, 1e-9);  // it stands there after the horizon
}

}  // namespace
}  // namespace carom
