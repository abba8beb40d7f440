#include "plugin/pybullet/lasting_pairs.h"

#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace carom {

using namespace plugin;

namespace {

constexpr double kStepTime = 1.0 / 240.0;
constexpr double kRollRadius = 0.05;
constexpr double kSpeed = 1.5;  // m/s, along x
constexpr BodyId kGround = 0;
constexpr BodyId kMover = 1;

/// A body over a substep, as Bullet moves it.
SubstepMotion substepOf(const ContactBody& body, const Vec3& position, const Vec3& velocity,
                        const Vec3& angularVelocity) {
  SubstepMotion motion{.body = body};
  motion.start = {position, Quat::Identity(), velocity, angularVelocity};
  motion.end = motion.start;
  motion.end.position += kStepTime * velocity;
  const double turn = kStepTime * angularVelocity.norm();
  if (turn > 0.0)
    motion.end.orientation = Quat(Eigen::AngleAxisd(turn, angularVelocity.normalized()));
  return motion;
}

SubstepMotion rollingBall(double slip = 0.0) {
  return substepOf({.mass = 0.5, .form = ContactBody::Form::sphere, .radius = kRollRadius},
                   {0.0, 0.0, kRollRadius}, {kSpeed, 0.0, 0.0},
                   {0.0, (kSpeed - slip) / kRollRadius, 0.0});
}

SubstepMotion slidingBox(double speed = kSpeed) {
  return substepOf({.mass = 0.5, .form = ContactBody::Form::box}, {0.0, 0.0, 0.03},
                   {speed, 0.0, 0.0}, Vec3::Zero());
}

TouchPoint pressed(double load = 4.905) {
  return {.body = kMover,
          .other = kGround,
          .normal = Vec3::UnitZ(),
          .impulse = load * kStepTime,
          .friction = {-0.3 * load * kStepTime, 0.0, 0.0}};
}

/// The same contact, with the floor first.
TouchPoint fromBelow(TouchPoint point) {
  std::swap(point.body, point.other);
  point.normal = -point.normal;
  point.friction = -point.friction;
  return point;
}

TEST(LastingPairs, BallRollsOverTheFloorWithoutSlip) {
  const ContactState state = contactStateOf(pressed(), rollingBall(), {}, kStepTime);
  EXPECT_LT(state.slipVelocity.norm(), 1e-12);
  EXPECT_LT((state.rollingVelocity - Vec3(kSpeed, 0.0, 0.0)).norm(), 1e-12);
  EXPECT_NEAR(state.normalLoad, 4.905, 1e-12);
  EXPECT_EQ(state.radius, kRollRadius);
  EXPECT_TRUE(std::isinf(state.otherRadius));
  EXPECT_NEAR((state.otherPathEnd - state.otherPathStart).norm(), kSpeed * kStepTime, 1e-12);
  // Over the ball it goes as far, along an arc.
  const double angle = kSpeed * kStepTime / kRollRadius;
  EXPECT_NEAR((state.pathEnd - state.pathStart).norm(), 2.0 * kRollRadius * std::sin(0.5 * angle),
              1e-12);
  EXPECT_NEAR(state.appliedImpulse.x(), -0.3 * 4.905 * kStepTime, 1e-15);
}

TEST(LastingPairs, BallThatSpinsSlips) {
  const ContactState state = contactStateOf(pressed(), rollingBall(0.4), {}, kStepTime);
  EXPECT_NEAR(state.slipVelocity.x(), 0.4, 1e-12);
  EXPECT_NEAR(state.rollingVelocity.x(), kSpeed - 0.2, 1e-12);
}

TEST(LastingPairs, BoxSlidesOnItsOwnSide) {
  const ContactState state = contactStateOf(pressed(), slidingBox(), {}, kStepTime);
  EXPECT_NEAR(state.slipVelocity.x(), kSpeed, 1e-12);
  EXPECT_LT((state.pathEnd - state.pathStart).norm(), 1e-12);
  EXPECT_NEAR((state.otherPathEnd - state.otherPathStart).norm(), kSpeed * kStepTime, 1e-12);
  EXPECT_TRUE(std::isinf(state.radius) && std::isinf(state.otherRadius));
}

/// Pairs in a world of a floor and one body.
class LastingPair : public testing::Test, private SubstepMotions {
 protected:
  std::vector<ContactState> substep(std::vector<PairContact> contacts) {
    const auto states = pairs.finish(time, kStepTime, contacts, *this);
    time += kStepTime;
    return {states.begin(), states.end()};
  }
  std::vector<ContactPhase> phases(const std::vector<PairContact>& contacts) {
    std::vector<ContactPhase> told;
    for (const ContactState& state : substep(contacts))
      told.push_back(state.phase);
    return told;
  }

  std::optional<SubstepMotion> motionOf(BodyId id) const override {
    return id == kGround ? SubstepMotion{} : body;
  }
  const BodyState* endStateOf(BodyId id) const override {
    return id == kGround ? nullptr : &body.end;
  }

  LastingPairs pairs;
  SubstepMotion body = slidingBox();
  double time = 0.0;  // s
};

using Phases = std::vector<ContactPhase>;

TEST_F(LastingPair, IsToldFromBothSidesAlike) {
  const ContactState one = substep({{pressed()}}).at(0);
  pairs.clear();
  const ContactState other = substep({{fromBelow(pressed())}}).at(0);
  EXPECT_EQ(one.body, kMover);
  EXPECT_EQ(other.body, kMover);
  EXPECT_EQ(one.normal, other.normal);
  EXPECT_EQ(one.slipVelocity, other.slipVelocity);
  EXPECT_EQ(one.appliedImpulse, other.appliedImpulse);
}

TEST_F(LastingPair, BeginsLastsAndEnds) {
  EXPECT_EQ(phases({{pressed()}}), Phases{ContactPhase::begin});
  EXPECT_EQ(phases({{pressed()}}), Phases{ContactPhase::during});
  EXPECT_EQ(phases({{pressed()}}), Phases{ContactPhase::during});
  EXPECT_EQ(phases({}), Phases{});
  EXPECT_EQ(phases({{pressed()}}), Phases{ContactPhase::during});  // it was not over
  EXPECT_EQ(phases({}), Phases{});
  EXPECT_EQ(phases({}), Phases{});
  const std::vector<ContactState> last = substep({});
  ASSERT_EQ(last.size(), 1U);
  EXPECT_EQ(last.front().phase, ContactPhase::end);
  EXPECT_EQ(last.front().normalLoad, 0.0);
  EXPECT_DOUBLE_EQ(last.front().time, 7 * kStepTime);
  EXPECT_EQ(phases({{pressed()}}), Phases{ContactPhase::begin});
}

TEST_F(LastingPair, ThatLiesStillIsToldOfWhatIsNew) {
  body = slidingBox(0.0);
  EXPECT_EQ(phases({{pressed()}}), Phases{ContactPhase::begin});
  for (int count = 0; count < 5; ++count)
    EXPECT_EQ(phases({{pressed()}}), Phases{});
  EXPECT_EQ(phases({{pressed(12.0)}}), Phases{ContactPhase::during});  // another load
  EXPECT_EQ(phases({{pressed(10.0)}}), Phases{});
  body = slidingBox();
  EXPECT_EQ(phases({{pressed()}}), Phases{ContactPhase::during});
  body = slidingBox(0.0);
  EXPECT_EQ(phases({{pressed()}}), Phases{ContactPhase::during});  // it has come to rest
  EXPECT_EQ(phases({{pressed()}}), Phases{});
}

TEST_F(LastingPair, DoesNotHaveTheImpulsesOfImpacts) {
  EXPECT_EQ(phases({{.mean = pressed(500.0), .isImpact = true}}), Phases{});
}

// The host has restored a state, in which nothing may touch what this contact has damped.
TEST_F(LastingPair, EndsWhereTheClockIsSet) {
  EXPECT_EQ(phases({{pressed()}}), Phases{ContactPhase::begin});
  const auto ends = pairs.end(9.0);
  ASSERT_EQ(ends.size(), 1U);
  EXPECT_EQ(ends.front().phase, ContactPhase::end);
  EXPECT_EQ(ends.front().time, 9.0);
  EXPECT_EQ(ends.front().body, kMover);
  EXPECT_TRUE(pairs.end(9.0).empty());
  EXPECT_EQ(phases({{pressed()}}), Phases{ContactPhase::begin});
}

TEST_F(LastingPair, OfARemovedBodyIsForgotten) {
  EXPECT_EQ(phases({{pressed()}}), Phases{ContactPhase::begin});
  pairs.removeBody(kMover);
  for (int count = 0; count < 5; ++count)
    EXPECT_EQ(phases({}), Phases{});
}

// A body that trembles as it slides approaches in each substep: only its first touch is an impact.
TEST(LastingPairs, ApproachThatGoesOnIsNoImpact) {
  ContactListener listener;
  listener.setBody(kMover, slidingBox().body);
  for (int substep = 0; substep < 12; ++substep) {
    listener.begin({substep * kStepTime, kStepTime, {0.0, 0.0, -9.81}, {}});
    BodyState state = slidingBox().start;
    state.velocity.z() = -0.2;
    listener.state(kMover, state);
    const std::vector<TouchPoint> points = {pressed()};
    listener.finish(points);
    ASSERT_EQ(listener.contacts().size(), 1U);
    EXPECT_TRUE(substep < 6 || !listener.contacts().front().isImpact) << substep;
  }
}

}  // namespace
}  // namespace carom
