#include "plugin/pybullet/contact_listener.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

namespace carom {

using namespace plugin;

namespace {

constexpr double kGravity = 9.81;         // m/s^2
constexpr double kSubstep = 1.0 / 240.0;  // s
constexpr double kRadius = 0.05;          // m
constexpr double kMass = 2.0;             // kg
constexpr double kRestitution = 0.8;      // each body's
constexpr double kInertia = 0.4 * kMass * kRadius * kRadius;
constexpr double kLoad = kMass * kGravity * kSubstep;  // N s, carries a resting ball
constexpr double kNanosecond = 1e-9;
constexpr BodyId kFloor = 7;
constexpr BodyId kBall = 3;
constexpr BodyId kOtherBall = 12;
const Vec3 kUp = Vec3::UnitZ();

ContactBody ball() {
  return {.mass = kMass,
          .inertia = Vec3::Constant(kInertia),
          .restitution = kRestitution,
          .form = ContactBody::Form::sphere,
          .radius = kRadius};
}

ContactBody box(const Vec3& halfEdges) {
  const Vec3 squares = halfEdges.cwiseAbs2();
  const Vec3 inertia = kMass / 3.0 * (Vec3::Constant(squares.sum()) - squares);
  return {.mass = kMass,
          .inertia = inertia,
          .restitution = kRestitution,
          .form = ContactBody::Form::box};
}

ContactBody ground() {
  return {.restitution = kRestitution, .form = ContactBody::Form::plane};
}

// The contact point of a ball over a floor at height 0.
TouchPoint onFloor(BodyId id, const Vec3& centre, double impulse) {
  const Vec3 lowest = centre - kRadius * kUp;
  return {.body = id,
          .other = kFloor,
          .positionOnBody = lowest,
          .positionOnOther = {lowest.x(), lowest.y(), 0.0},
          .normal = kUp,
          .distance = lowest.z(),
          .impulse = impulse};
}

// A listener that is told substeps one after the other, as a server would do.
class Told {
 public:
  explicit Told(double gravity = kGravity) : gravity_(gravity) {
    listener.setBody(kFloor, ground());
    listener.setBody(kBall, ball());
    listener.setBody(kOtherBall, ball());
  }

  void begin() {
    listener.begin({.time = time,
                    .duration = kSubstep,
                    .gravity = -gravity_ * kUp,
                    .solver = {.restitutionSpeed = 0.2}});
  }
  std::vector<ImpulseEvent> finish(const std::vector<TouchPoint>& points = {}) {
    const auto events = listener.finish(points);
    time += kSubstep;
    return {events.begin(), events.end()};
  }

  ContactListener listener;
  double time = 0.0;  // s

 private:
  double gravity_;
};

// A body in free fall by symplectic Euler: first the velocity, then the place.
struct Falling {
  BodyState state;
  void step(double gravity = kGravity) {
    state.velocity -= kSubstep * gravity * kUp;
    state.position += kSubstep * state.velocity;
  }
};

// Lets a ball fall on the floor and reports the contact in the first substep for which `isTold`(gap
// in m, speed in m/s) is true.
template <class IsTold>
std::vector<ImpulseEvent> drop(double height, IsTold isTold) {
  Told told;
  Falling falling{{.position = {0.1, 0.2, kRadius + height}}};
  for (int step = 0; step < 1000; ++step) {
    told.begin();
    told.listener.state(kBall, falling.state);
    const double gap = falling.state.position.z() - kRadius;
    if (isTold(gap, -falling.state.velocity.z()))
      return told.finish({onFloor(kBall, falling.state.position, 1.0)});
    EXPECT_TRUE(told.finish().empty());
    falling.step();
  }
  return {};
}

// Time of touch on the parabola through the nodes of symplectic Euler, which begins with the speed
// g dt / 2.
double touchTime(double height) {
  const double first = 0.5 * kGravity * kSubstep;
  return (std::sqrt(first * first + 2.0 * kGravity * height) - first) / kGravity;
}

double touchSpeed(double height) {
  return std::hypot(0.5 * kGravity * kSubstep, std::sqrt(2.0 * kGravity * height));
}

class DropHeight : public testing::TestWithParam<double> {};

TEST_P(DropHeight, OverlappingBallHitTheFloorWhenItsParabolaDid) {
  const auto events = drop(GetParam(), [](double gap, double) { return gap < 0.0; });
  ASSERT_EQ(events.size(), 2U);
  EXPECT_NEAR(events[0].time, touchTime(GetParam()), kNanosecond);
  EXPECT_NEAR(events[0].approachSpeed, touchSpeed(GetParam()), 1e-9);
}

TEST_P(DropHeight, BallCaughtAheadOfTimeHitsWhenItsParabolaWould) {
  const auto events =
      drop(GetParam(), [](double gap, double speed) { return gap < 1.5 * speed * kSubstep; });
  ASSERT_EQ(events.size(), 2U);
  EXPECT_NEAR(events[0].time, touchTime(GetParam()), kNanosecond);
  EXPECT_NEAR(events[0].approachSpeed, touchSpeed(GetParam()), 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Heights, DropHeight, testing::Values(0.011, 0.1, 0.3333, 0.5, 2.0));

TEST(ContactListener, ImpulseIsThatOfNewtonsImpact) {
  const auto events = drop(0.5, [](double gap, double) { return gap < 0.0; });
  ASSERT_EQ(events.size(), 2U);
  const ImpulseEvent& event = events[0];
  EXPECT_EQ(event.body, kBall);
  EXPECT_NEAR(event.effectiveMass, kMass, 1e-12);
  const double impulse = (1.0 + kRestitution * kRestitution) * kMass * touchSpeed(0.5);
  EXPECT_NEAR((event.impulse - impulse * kUp).norm(), 0.0, 1e-9);
  EXPECT_NEAR(event.bodyPosition.z(), kRadius, 1e-9);
  EXPECT_NEAR(event.position.z(), 0.0, 1e-9);
  EXPECT_NEAR(event.bodyVelocity.z(), -touchSpeed(0.5), 1e-9);
  EXPECT_EQ(event.radius, kRadius);
  EXPECT_TRUE(std::isinf(event.otherRadius));
  EXPECT_NEAR((event.appliedImpulse - 1.0 * kUp).norm(), 0.0, 1e-12);
}

TEST(ContactListener, BothBodiesShareOneImpactWithOppositeImpulses) {
  const auto events = drop(0.5, [](double gap, double) { return gap < 0.0; });
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0].body, events[1].other);
  EXPECT_EQ(events[0].other, events[1].body);
  EXPECT_EQ(events[0].time, events[1].time);
  EXPECT_EQ((events[0].impulse + events[1].impulse).norm(), 0.0);
  EXPECT_EQ(events[0].radius, events[1].otherRadius);
}

TEST(ContactListener, ImpactBelowTheServersThresholdDoesNotBounce) {
  const auto events = drop(0.001, [](double gap, double) { return gap < 0.0; });
  ASSERT_EQ(events.size(), 2U);
  EXPECT_NEAR(events[0].impulse.norm(), kMass * touchSpeed(0.001), 1e-9);
}

// A ball flies at an equal one and hits it half a diameter off centre. Gravity acts on both, so
// that their relative way is straight.
TEST(ContactListener, BallsMeetWhereTheirStraightRelativeWayHasTheirDistance) {
  Told told;
  const double aside = kRadius;
  const double speed = 6.0;
  Falling left{{.position = {-0.4, 0.0, 5.0}, .velocity = {speed, 0.0, 0.0}}};
  Falling right{{.position = {0.0, aside, 5.0}}};
  std::vector<ImpulseEvent> events;
  for (int step = 0; step < 40 && events.empty(); ++step) {
    told.begin();
    told.listener.state(kBall, left.state);
    told.listener.state(kOtherBall, right.state);
    std::vector<TouchPoint> points;
    const Vec3 apart = left.state.position - right.state.position;
    const double gap = apart.norm() - 2.0 * kRadius;
    const Vec3 normal = apart.normalized();
    if (gap < 0.0) {
      points.push_back({.body = kBall,
                        .other = kOtherBall,
                        .positionOnBody = left.state.position - kRadius * normal,
                        .positionOnOther = right.state.position + kRadius * normal,
                        .normal = normal,
                        .distance = gap,
                        .impulse = 1.0});
    }
    events = told.finish(points);
    left.step();
    right.step();
  }
  ASSERT_EQ(events.size(), 2U);
  const double along = std::sqrt(4.0 * kRadius * kRadius - aside * aside);
  EXPECT_NEAR(events[0].time, (0.4 - along) / speed, kNanosecond);
  const Vec3 normal = Vec3(-along, -aside, 0.0) / (2.0 * kRadius);
  EXPECT_NEAR((events[0].normal - normal).norm(), 0.0, 1e-9);
  EXPECT_NEAR(events[0].approachSpeed, speed * along / (2.0 * kRadius), 1e-9);
  EXPECT_NEAR(events[0].effectiveMass, 0.5 * kMass, 1e-12);
}

// A box that is not turned lands on the middle of a lower edge: the lever's horizontal part is
// half.x.
TEST(ContactListener, BoxOnItsCornerAnswersByItsMassAndInertia) {
  Told told;
  const Vec3 half(0.1, 0.02, 0.1);
  told.listener.setBody(kBall, box(half));
  const Quat flat = Quat::Identity();
  const Vec3 velocity(0.0, 0.0, -3.0);
  const Vec3 corner(half.x(), 0.0, -half.z());
  // Two substeps give the box a past; the contact is 1 mm deep.
  const Vec3 centre = -0.001 * kUp - corner;
  told.begin();
  told.listener.state(kBall, {centre - kSubstep * velocity, flat, velocity, Vec3::Zero()});
  told.finish();
  told.begin();
  told.listener.state(kBall, {centre, flat, velocity, Vec3::Zero()});
  const auto events = told.finish({{.body = kFloor,
                                    .other = kBall,
                                    .positionOnBody = Vec3::Zero(),
                                    .positionOnOther = centre + corner,
                                    .normal = -kUp,
                                    .distance = -0.001,
                                    .impulse = 1.0}});
  ASSERT_EQ(events.size(), 2U);
  const double inertia = kMass / 3.0 * (half.x() * half.x() + half.z() * half.z());
  const double mass = 1.0 / (1.0 / kMass + half.x() * half.x() / inertia);
  EXPECT_EQ(events[0].body, kBall);
  EXPECT_NEAR(events[0].effectiveMass, mass, 1e-12);
  EXPECT_NEAR(events[0].time, kSubstep - 0.001 / 3.0, kNanosecond);  // no acceleration was reported
  EXPECT_TRUE((events[0].normal - kUp).isZero());
}

// A box that falls and turns about y, whose state is known at any time.
struct TumblingBox {
  static constexpr double kSpin = 8.0;  // rad/s
  double angle = 0.0;                   // rad, at time 0
  Vec3 half{0.1, 0.2, 0.05};            // m

  double angleAt(double time) const { return angle + kSpin * time; }
  double heightAt(double time) const { return 0.5 - 0.5 * kGravity * time * time; }
  BodyState stateAt(double time) const {
    return {.position = {0.0, 0.0, heightAt(time)},
            .orientation = Quat(Eigen::AngleAxisd(angleAt(time), Vec3::UnitY())),
            // The velocity with which symplectic Euler gets from the node before to this one.
            .velocity = (heightAt(time) - heightAt(time - kSubstep)) / kSubstep * kUp,
            .angularVelocity = kSpin * Vec3::UnitY()};
  }
  // The two lower corners of the section y = 0, the lowest first.
  std::array<Vec3, 2> cornersAt(double time) const {
    const BodyState state = stateAt(time);
    std::array<Vec3, 4> corners;
    for (std::size_t index = 0; index < corners.size(); ++index) {
      const Vec3 corner(index % 2 == 0 ? half.x() : -half.x(), 0.0,
                        index < 2 ? half.z() : -half.z());
      corners[index] = state.position + state.orientation * corner;
    }
    std::ranges::sort(corners, {}, [](const Vec3& corner) { return corner.z(); });
    return {corners[0], corners[1]};
  }
  // The time of touch, by bisection between a time in the air and one in the floor.
  double touchTime(double before, double after) const {
    for (int halving = 0; halving < 60; ++halving) {
      const double middle = 0.5 * (before + after);
      (cornersAt(middle).front().z() > 0.0 ? before : after) = middle;
    }
    return after;
  }
};

TEST(ContactListener, CornersOfATurningBoxAreDatedWithinTwentyMicroseconds) {
  double worst = 0.0;
  constexpr int kPhases = 256;
  for (int phase = 0; phase < kPhases; ++phase) {
    const TumblingBox tumbling{.angle = 2.0 * std::numbers::pi * phase / kPhases};
    Told told;
    told.listener.setBody(kBall, box(tumbling.half));
    std::vector<ImpulseEvent> events;
    while (events.empty() && told.time < 1.0) {
      told.begin();
      told.listener.state(kBall, tumbling.stateAt(told.time));
      const double now = told.time;
      std::vector<TouchPoint> points;
      for (const Vec3& corner : tumbling.cornersAt(now)) {
        points.push_back({.body = kBall,
                          .other = kFloor,
                          .positionOnBody = corner,
                          .positionOnOther = {corner.x(), corner.y(), 0.0},
                          .normal = kUp,
                          .distance = corner.z(),
                          .impulse = corner.z() < 0.0 ? 1.0 : 0.0});
      }
      events = told.finish(points);
      if (events.empty()) continue;
      const double error = events[0].time - tumbling.touchTime(now - kSubstep, now);
      worst = std::max(worst, std::abs(error));
    }
    ASSERT_EQ(events.size(), 2U) << "phase " << phase;
  }
  RecordProperty("worst_us", std::to_string(worst * 1e6));
  EXPECT_LT(worst, 20e-6);
}

TEST(ContactListener, FourCornersOfAFlatBoxAreOneImpactThroughItsCentre) {
  Told told;
  const Vec3 half(0.1, 0.2, 0.05);
  told.listener.setBody(kBall, box(half));
  const BodyState state{.position = {0.0, 0.0, half.z()}, .velocity = {0.0, 0.0, -2.0}};
  told.begin();
  told.listener.state(kBall, state);
  std::vector<TouchPoint> points;
  for (const double x : {-half.x(), half.x()})
    for (const double y : {-half.y(), half.y()})
      points.push_back({.body = kBall,
                        .other = kFloor,
                        .positionOnBody = {x, y, 0.0},
                        .positionOnOther = {x, y, 0.0},
                        .normal = kUp,
                        .impulse = 0.25});
  const auto events = told.finish(points);
  ASSERT_EQ(events.size(), 2U);
  EXPECT_NEAR(events[0].effectiveMass, kMass, 1e-12);
  EXPECT_NEAR(events[0].position.head<2>().norm(), 0.0, 1e-12);
  EXPECT_TRUE(std::isinf(events[0].radius));
}

TEST(ContactListener, BallAtRestMakesNoImpactHoweverItTrembles) {
  Told told;
  std::size_t events = 0;
  for (int step = 0; step < 480; ++step) {
    told.begin();
    const double tremble = kGravity * kSubstep * std::sin(1.7 * step);
    const BodyState state{.position = {0.0, 0.0, kRadius}, .velocity = tremble * kUp};
    told.listener.state(kBall, state);
    events += told.finish({onFloor(kBall, state.position, kLoad)}).size();
  }
  // The first substep is a touch at 0 m/s; after that the contact lasts.
  EXPECT_EQ(events, 0U);
}

TEST(ContactListener, BallOnABallMakesNoImpactThoughTheSolverWaitsForOverlap) {
  Told told;
  const double gap = 1e-7;
  Falling upper{{.position = {0.0, 0.0, 3.0 * kRadius + gap}}};
  told.listener.setBody(kOtherBall, {.form = ContactBody::Form::sphere, .radius = kRadius});
  told.begin();
  told.listener.state(kBall, upper.state);
  told.listener.state(kOtherBall, {.position = {0.0, 0.0, kRadius}});
  EXPECT_TRUE(told.finish().empty());
  upper.step();
  told.begin();
  told.listener.state(kBall, upper.state);
  told.listener.state(kOtherBall, {.position = {0.0, 0.0, kRadius}});
  const double distance = upper.state.position.z() - 3.0 * kRadius;
  EXPECT_LT(distance, 0.0);
  EXPECT_TRUE(told.finish({{.body = kBall,
                            .other = kOtherBall,
                            .positionOnBody = {0.0, 0.0, upper.state.position.z() - kRadius},
                            .positionOnOther = {0.0, 0.0, 2.0 * kRadius},
                            .normal = kUp,
                            .distance = distance,
                            .impulse = 2.0 * kLoad}})
                  .empty());
}

TEST(ContactListener, BoxThatSlidesMakesNoImpact) {
  Told told;
  const Vec3 half(0.1, 0.1, 0.05);
  told.listener.setBody(kBall, box(half));
  std::size_t events = 0;
  for (int step = 0; step < 240; ++step) {
    told.begin();
    const bool isCaught = step % 2 == 0;  // else it falls
    const double fall = isCaught && step > 0 ? kGravity * kSubstep : 0.0;
    const BodyState state{.position = {2.0 * step * kSubstep, 0.0, half.z()},
                          .velocity = {2.0, 0.0, -fall}};
    told.listener.state(kBall, state);
    const Vec3 corner = state.position + Vec3(step % 3 == 0 ? half.x() : -half.x(), 0.1, -0.05);
    events += told.finish({{.body = kBall,
                            .other = kFloor,
                            .positionOnBody = corner,
                            .positionOnOther = corner,
                            .normal = kUp,
                            .impulse = isCaught ? 2.0 * kLoad : 0.0}})
                  .size();
  }
  EXPECT_EQ(events, 0U);
}

// A solver below its restitution threshold slows the ball down so that it just touches at the end
// of the substep, and stops it in the next one.
TEST(ContactListener, ImpactSpreadOverSubstepsIsOne) {
  Told told;
  const double speed = 0.15;
  const double gap = 0.6 * speed * kSubstep;
  told.begin();
  BodyState state{.position = {0.0, 0.0, kRadius + gap}, .velocity = -speed * kUp};
  told.listener.state(kBall, state);
  EXPECT_EQ(told.finish({onFloor(kBall, state.position, 0.5)}).size(), 2U);
  told.begin();
  state = {.position = {0.0, 0.0, kRadius}, .velocity = -gap / kSubstep * kUp};
  told.listener.state(kBall, state);
  EXPECT_TRUE(told.finish({onFloor(kBall, state.position, 0.5)}).empty());
}

// A solver may also let the ball fall for a substep in between.
TEST(ContactListener, ImpactThatTheSolverPutsOffIsOne) {
  Told told;
  const std::vector<double> speeds = {0.34, 0.11, 0.15, 0.12};
  const std::vector<double> impulses = {0.5, 0.0, 0.1, 0.3};
  std::size_t events = 0;
  for (std::size_t step = 0; step < speeds.size(); ++step) {
    told.begin();
    const BodyState state{.position = {0.0, 0.0, kRadius + 0.001}, .velocity = -speeds[step] * kUp};
    told.listener.state(kBall, state);
    events += told.finish({onFloor(kBall, state.position, impulses[step])}).size();
  }
  EXPECT_EQ(events, 2U);
}

TEST(ContactListener, BallThatCameBackIsHeardAgain) {
  Told told;
  const BodyState down{.position = {0.0, 0.0, kRadius}, .velocity = -1.0 * kUp};
  std::size_t events = 0;
  for (int bounce = 0; bounce < 3; ++bounce) {
    told.begin();
    told.listener.state(kBall, down);
    events += told.finish({onFloor(kBall, down.position, 3.0)}).size();
    told.begin();
    told.listener.state(kBall, {.position = {0.0, 0.0, kRadius}, .velocity = kUp});
    events += told.finish().size();
  }
  EXPECT_EQ(events, 6U);
}

TEST(ContactListener, PointsThatTheSolverLeavesAloneAreNoContact) {
  Told told;
  const BodyState down{.position = {0.0, 0.0, kRadius}, .velocity = -1.0 * kUp};
  told.begin();
  told.listener.state(kBall, down);
  EXPECT_TRUE(told.finish({onFloor(kBall, down.position, 0.0)}).empty());
}

TEST(ContactListener, UnknownRestitutionIsWhatTheSolverDid) {
  Told told;
  ContactBody unknown = ball();
  unknown.restitution = std::nullopt;
  told.listener.setBody(kBall, unknown);
  const BodyState down{.position = {0.0, 0.0, kRadius}, .velocity = -1.0 * kUp};
  told.begin();
  told.listener.state(kBall, down);
  const auto events = told.finish({onFloor(kBall, down.position, 1.7 * kMass)});
  ASSERT_EQ(events.size(), 2U);
  EXPECT_NEAR(events[0].impulse.norm(), 1.7 * kMass, 1e-9);
}

TEST(ContactListener, BallThatWasPutThereHitsAtThatMoment) {
  Told told;
  told.begin();
  told.listener.state(kBall, {.position = {0.0, 0.0, 3.0}});
  told.finish();
  told.begin();
  const BodyState there{.position = {0.0, 0.0, kRadius - 0.01}, .velocity = -1.0 * kUp};
  told.listener.state(kBall, there);
  const double now = told.time;
  const auto events = told.finish({onFloor(kBall, there.position, 3.0)});
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0].time, now);
  EXPECT_NEAR(events[0].approachSpeed, 1.0, 1e-12);
}

// A body that cannot move is told of once; where it is stays known.
TEST(ContactListener, AFixedBallIsWhereItWasAfterThePastIsForgotten) {
  Told told;
  const Vec3 place(3.0, 0.0, 1.0);
  ContactBody fixed = ball();
  fixed.mass = std::numeric_limits<double>::infinity();
  told.listener.setBody(kOtherBall, fixed);
  told.begin();
  told.listener.state(kOtherBall, {.position = place});
  told.finish();
  told.listener.forgetPast();
  Falling falling{{.position = place + (2.0 * kRadius + 0.05) * kUp}};
  std::vector<ImpulseEvent> events;
  for (int step = 0; step < 100 && events.empty(); ++step) {
    told.begin();
    told.listener.state(kBall, falling.state);
    const double gap = (falling.state.position - place).z() - 2.0 * kRadius;
    std::vector<TouchPoint> points;
    if (gap < 0.0)
      points.push_back({.body = kBall,
                        .other = kOtherBall,
                        .positionOnBody = falling.state.position - kRadius * kUp,
                        .positionOnOther = place + kRadius * kUp,
                        .normal = kUp,
                        .distance = gap,
                        .impulse = 1.0});
    events = told.finish(points);
    falling.step();
  }
  ASSERT_EQ(events.size(), 2U);
  EXPECT_NEAR(events[0].approachSpeed, touchSpeed(0.05), 1e-9);
  EXPECT_NEAR((events[0].normal - kUp).norm(), 0.0, 1e-9);
  EXPECT_NEAR((events[0].position - place - kRadius * kUp).norm(), 0.0, 1e-6);
  EXPECT_EQ(events[0].otherPosition, place);
}

TEST(ContactListener, WhatHangsInTheAirIsHeld) {
  Told told;
  Falling falling{{.position = {1.0, 0.0, 5.0}}};
  for (int step = 0; step < 3; ++step) {
    told.begin();
    told.listener.state(kBall, {.position = {0.0, 0.0, 5.0}});
    told.listener.state(kOtherBall, falling.state);
    falling.step();
    EXPECT_EQ(told.listener.isHeld(kBall), step > 0) << "after substep " << step;
    EXPECT_FALSE(told.listener.isHeld(kOtherBall));
    told.finish();
  }
}

TEST(ContactListener, RemovedBodyLeavesNothingBehind) {
  Told told;
  const BodyState down{.position = {0.0, 0.0, kRadius}, .velocity = -1.0 * kUp};
  told.begin();
  told.listener.state(kBall, down);
  EXPECT_EQ(told.finish({onFloor(kBall, down.position, 3.0)}).size(), 2U);
  told.listener.removeBody(kBall);
  told.listener.setBody(kBall, ball());
  told.begin();
  told.listener.state(kBall, down);
  // After the body was replaced, the same approach is a new impact, not the rest of the first.
  EXPECT_EQ(told.finish({onFloor(kBall, down.position, 3.0)}).size(), 2U);
}

}  // namespace
}  // namespace carom
