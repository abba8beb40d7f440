#include <cmath>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "tests/native/sphere_worlds.h"

namespace carom::test {
namespace {

constexpr double kGravity = 9.81;
constexpr double kBallRadius = 0.028575;  // m, a pool ball
constexpr double kBallMass = 0.17;

Sphere ballAt(BodyId id, double x, double z, const Vec3& velocity) {
  Sphere ball = sphereAt(id, {x, kBallRadius, z}, velocity);
  ball.radius = kBallRadius;
  ball.mass = kBallMass;
  ball.restitution = 1.0;
  ball.friction.sliding = 0.2;
  return ball;
}

SphereWorld table() {
  SphereWorld world;
  world.gravity = kEarthGravity;
  world.planes = {floorPlane(0.5)};
  world.planes[0].friction = 0.2;
  return world;
}

/// Velocity in m/s of the ball's lowest point.
Vec3 slipOf(const SphereState& state, double radius) {
  return state.velocity + state.spin.cross(Vec3(0.0, -radius, 0.0));
}

}  // namespace

TEST(Rolling, ASlidingBallRollsWithFiveSeventhsOfItsSpeed) {
  SphereWorld world = table();
  world.spheres = {ballAt(1, 0.0, 0.0, {2.0, 0.0, 0.0})};
  SphereStepper stepper = stepperOf(world);
  const double slowing = 0.2 * kGravity;
  const double rolls = 2.0 * 2.0 / (7.0 * slowing);
  for (const double share : {0.3, 0.9, 1.0}) {
    const double time = share * rolls;
    stepper.advanceTo(time);
    EXPECT_NEAR(stepper.state(0).velocity.x(), 2.0 - slowing * time, 1e-13);
    EXPECT_NEAR(stepper.state(0).position.x(), time * (2.0 - 0.5 * slowing * time), 1e-13);
    EXPECT_NEAR(stepper.state(0).spin.z(), -2.5 * slowing * time / kBallRadius, 1e-11);
  }
  stepper.advanceTo(rolls + 5.0);
  EXPECT_NEAR(stepper.state(0).velocity.x(), 2.0 * 5.0 / 7.0, 1e-13);
  EXPECT_NEAR(slipOf(stepper.state(0), kBallRadius).norm(), 0.0, 1e-13);
  EXPECT_EQ(stepper.state(0).position.y(), kBallRadius);
  EXPECT_TRUE(stepper.advanceTo(100.0).empty());
}

// Drag and a spring that hardly pull change hardly anything: friction acts beside them.
TEST(Rolling, ABallThatDragOrASpringPullsRollsToo) {
  for (const bool hasSpring : {false, true}) {
    SphereWorld world = table();
    world.spheres = {ballAt(1, 0.0, 0.0, {2.0, 0.0, 0.0})};
    if (hasSpring)
      world.springs = {{1, kAnchor, {0.0, 1.0, 0.0}, 1.0, 1e-9, 0.0}};
    else
      world.drag.rate = 1e-7;
    SphereStepper stepper = stepperOf(world);
    const double slowing = 0.2 * kGravity;
    const double rolls = 2.0 * 2.0 / (7.0 * slowing);
    stepper.advanceTo(0.5 * rolls);
    // The plane holds it from its first contact on, a third of a millisecond after the beginning.
    EXPECT_NEAR(stepper.state(0).velocity.x(), 2.0 - 0.5 * slowing * rolls, 1e-3) << hasSpring;
    stepper.advanceTo(rolls + 1.0);
    EXPECT_NEAR(stepper.state(0).velocity.x(), 2.0 * 5.0 / 7.0, 1e-5) << hasSpring;
    EXPECT_NEAR(slipOf(stepper.state(0), kBallRadius).norm(), 0.0, 1e-9) << hasSpring;
  }
}

// A spring of w = 2 pi / s whose ball rolls moves 7/5 of its mass.
TEST(Rolling, ABallOnASpringRollsToAndFroAsSevenFifthsOfItsMass) {
  SphereWorld world = table();
  const double stiffness = 1.4 * kBallMass * std::pow(2.0 * std::numbers::pi, 2);
  world.spheres = {ballAt(1, 0.1, 0.0, Vec3::Zero())};
  world.spheres[0].friction.sliding = world.planes[0].friction = 2.0;
  world.springs = {{1, kAnchor, {0.0, kBallRadius, 0.0}, 0.0, stiffness, 0.0}};
  SphereStepper stepper = stepperOf(world);
  for (int quarter = 1; quarter <= 8; ++quarter) {
    stepper.advanceTo(0.25 * quarter);
    const double phase = 0.5 * std::numbers::pi * quarter;
    EXPECT_NEAR(stepper.state(0).position.x(), 0.1 * std::cos(phase), 2e-3) << quarter;
    EXPECT_NEAR(slipOf(stepper.state(0), kBallRadius).norm(), 0.0, 2e-3) << quarter;
  }
}

TEST(Rolling, ADrawShotComesBack) {
  // Back spin of more than 5/2 of the speed over the radius turns the ball round: the angular
  // momentum about a point of the table stays, (5 v + 2 r w) / 7.
  SphereWorld world = table();
  world.spheres = {ballAt(1, 0.0, 0.0, {1.0, 0.0, 0.0})};
  world.spheres[0].friction.spin = {0.0, 0.0, 4.0 / kBallRadius};
  SphereStepper stepper = stepperOf(world);
  stepper.advanceTo(5.0);
  EXPECT_NEAR(stepper.state(0).velocity.x(), (5.0 - 2.0 * 4.0) / 7.0, 1e-12);
}

TEST(Rolling, ASwervingBallFollowsAParabola) {
  // With side spin about its way the ball slips at an angle to the way, but in a constant
  // direction.
  SphereWorld world = table();
  world.spheres = {ballAt(1, 0.0, 0.0, {1.5, 0.0, 0.0})};
  world.spheres[0].friction.spin = {30.0, 20.0, 10.0};
  SphereStepper stepper = stepperOf(world);
  const Vec3 slip = slipOf({{}, {1.5, 0.0, 0.0}, {30.0, 20.0, 10.0}}, kBallRadius);
  const Vec3 slowing = 0.2 * kGravity * slip.normalized();
  const double rolls = 2.0 * slip.norm() / (7.0 * 0.2 * kGravity);
  stepper.advanceTo(0.7 * rolls);
  const double time = 0.7 * rolls;
  const Vec3 expected = time * Vec3(1.5, 0.0, 0.0) - 0.5 * time * time * slowing;
  EXPECT_NEAR((stepper.state(0).position - Vec3(0.0, kBallRadius, 0.0) - expected).norm(), 0.0,
              1e-13);
  stepper.advanceTo(rolls + 1.0);
  EXPECT_NEAR((stepper.state(0).velocity - (Vec3(1.5, 0.0, 0.0) - rolls * slowing)).norm(), 0.0,
              1e-12);
  EXPECT_NEAR(stepper.state(0).spin.y(), 20.0, 1e-12);  // nothing brakes it
}

TEST(Rolling, ResistanceStopsARollingBallAndPivotingFrictionItsSpin) {
  SphereWorld world = table();
  world.spheres = {ballAt(1, 0.0, 0.0, {1.0, 0.0, 0.0})};
  world.spheres[0].friction.rolling = 0.01;
  world.spheres[0].friction.pivoting = 1e-4;
  world.spheres[0].friction.spin = {0.0, 10.0, -1.0 / kBallRadius};  // it rolls from the start
  SphereStepper stepper = stepperOf(world);
  const double pivoting = 1e-4 * kGravity / (0.4 * kBallRadius * kBallRadius);
  stepper.advanceTo(3.0);
  EXPECT_NEAR(stepper.state(0).velocity.x(), 1.0 - 0.0981 * 3.0, 1e-12);
  EXPECT_NEAR(stepper.state(0).spin.y(), 10.0 - pivoting * 3.0, 1e-11);
  stepper.advanceTo(100.0);
  EXPECT_NEAR(stepper.state(0).position.x(), 1.0 / (2.0 * 0.0981), 1e-9);
  EXPECT_EQ(stepper.state(0).velocity, Vec3::Zero());
  EXPECT_LT(stepper.state(0).spin.norm(), 1e-12);
}

TEST(Rolling, ABallOnASlopeRollsOrSlidesAsItsFrictionAllows) {
  for (const double friction : {0.5, 0.1}) {
    SphereWorld world;
    world.gravity = kEarthGravity;
    const double angle = 0.5;
    const Vec3 normal(std::sin(angle), std::cos(angle), 0.0);
    Sphere ball = sphereAt(1, 0.05 * normal);
    ball.restitution = 0.5;
    ball.friction.sliding = friction;
    world.spheres = {ball};
    world.planes = {{kFirstPlane, normal, 0.0, 0.5}};
    world.planes[0].friction = friction;
    SphereStepper stepper = stepperOf(world);
    stepper.advanceTo(1.0);
    const double pull = kGravity * std::sin(angle);
    const double rolling = 5.0 / 7.0 * pull;
    const double sliding = pull - friction * kGravity * std::cos(angle);
    const bool grips = 2.0 / 7.0 * pull <= friction * kGravity * std::cos(angle);
    EXPECT_EQ(grips, friction == 0.5);
    // First the ball falls, without friction, through the rounding of its place: 1e-17 m in some
    // ns.
    EXPECT_NEAR(stepper.state(0).velocity.norm(), grips ? rolling : sliding, 1e-8);
  }
}

TEST(Rolling, AcrossASlopeTheCourseTendsToTheIntegratedOne) {
  // The ball slides across a slope, where the slip turns and there is no closed form: the oracle
  // makes small steps.
  const double angle = 0.3;
  const Vec3 normal(std::sin(angle), std::cos(angle), 0.0);
  SphereWorld world;
  world.gravity = kEarthGravity;
  Sphere ball = sphereAt(1, 0.05 * normal, {0.0, 0.0, 1.0});
  ball.friction.sliding = 0.2;
  world.spheres = {ball};
  world.planes = {{kFirstPlane, normal, 0.0, 0.0}};
  world.planes[0].friction = 0.2;
  SphereStepper stepper = stepperOf(world);
  stepper.advanceTo(0.5);

  const double support = kGravity * normal.y();
  const Vec3 pull = kEarthGravity + support * normal;
  Vec3 velocity(0.0, 0.0, 1.0);
  Vec3 slip = velocity;
  const double step = 1e-6;
  for (int count = 0; count < 500000; ++count) {
    const bool rolls = slip.norm() < 2e-6;
    const Vec3 friction =
        rolls ? Vec3(-2.0 / 7.0 * pull) : Vec3(-0.2 * support * slip.normalized());
    velocity += step * (pull + friction);
    slip = rolls ? Vec3::Zero() : Vec3(slip + step * (pull + 3.5 * friction));
  }
  EXPECT_LT((stepper.state(0).velocity - velocity).norm(), 1e-4);
}

TEST(Rolling, ABallThatSpinsIntoAWallComesAwayFromItInFewContacts) {
  // Gravity draws the ball off the wall, but at first the friction of its spin on the floor is
  // stronger.
  for (const bool box : {false, true}) {
    SphereWorld world = table();
    world.gravity = {0.0, -9.81, 0.2};
    if (box) {
      Box block;
      block.id = kFirstPlane + 1;
      block.centre = {0.0, 0.5, -0.1};
      block.halfExtents = {1.0, 0.5, 0.1};
      block.restitution = 0.5;
      world.boxes = {block};
    } else {
      world.planes.push_back({kFirstPlane + 1, Vec3::UnitZ(), 0.0, 0.5});
    }
    world.spheres = {ballAt(1, 0.0, kBallRadius, Vec3::Zero())};
    world.spheres[0].friction.spin = {-40.0, 0.0, 0.0};
    SphereStepper stepper = stepperOf(world);
    EXPECT_TRUE(stepper.advanceTo(0.01).empty());
    EXPECT_NEAR(stepper.state(0).position.z(), kBallRadius, 1e-4) << "still pressed to it";
    stepper.advanceTo(5.0);
    EXPECT_LT(stepper.counters().restContacts, 5000U) << "hops of 0.1 ms, while it is pressed";
    EXPECT_EQ(stepper.counters().collapses, 0U);
    EXPECT_GT(stepper.state(0).velocity.z(), 0.3) << "it rolls away, by 5/7 of the pull";
    EXPECT_LT(slipOf(stepper.state(0), kBallRadius).norm(), 1e-9);
  }
}

TEST(Rolling, BallsThatSpinInCornersDoNotLockUpTime) {
  // Friction on one wall pushes a ball off the other and back, so that contacts alternate within
  // ns.
  for (const std::uint64_t seed : {41U, 43U, 44U, 45U}) {
    SphereWorld world = gasInBox(3, 0.004, seed);
    world.gravity = {0.3, -9.81, 0.2};
    SplitMix random(seed);
    for (Plane& plane : world.planes)
      plane.friction = 0.3;
    for (Sphere& sphere : world.spheres) {
      sphere.friction.sliding = 0.3;
      sphere.friction.spin = random.inCube(20.0);
    }
    SphereStepper stepper = stepperOf(world);
    for (int step = 1; step <= 50 && stepper.counters().restContacts < 400'000; ++step)
      stepper.advanceTo(0.005 * step);
    EXPECT_EQ(stepper.time(), 0.25) << seed;
    EXPECT_LT(stepper.counters().collapses, 50U) << seed;
    EXPECT_TRUE(valid(stepper));
  }
}

TEST(Rolling, AnImpactWithFrictionKeepsTheAngularMomentumAboutTheContact) {
  // Two spinning balls in flight meet at an angle: momentum stays, and so does each ball's angular
  // momentum about the point of contact; the slip is either gone or changed by the impulse of
  // sliding friction.
  for (const double friction : {0.05, 10.0}) {
    SphereWorld world;
    world.spheres = {ballAt(1, 0.0, 0.0, {1.0, 0.3, 0.0}), ballAt(2, 0.2, 0.01, {-0.5, 0.1, 0.2})};
    for (Sphere& ball : world.spheres) {
      ball.friction.sliding = friction;
      ball.friction.spin = {20.0, -30.0, 10.0};
    }
    world.spheres[1].mass = 0.3;
    SphereStepper stepper = stepperOf(world);
    const auto events = stepper.advanceTo(0.3);
    ASSERT_EQ(events.size(), 2U);
    for (const ImpulseEvent& event : events)
      EXPECT_EQ(event.bodyAngularVelocity, Vec3(20.0, -30.0, 10.0)) << "that before the impact";
    const Vec3 normal = events[0].normal;
    const double impulse = events[0].impulse.norm();
    const auto after = [&](std::size_t ball) { return stepper.state(ball); };
    const Vec3 pushed = kBallMass * (after(0).velocity - Vec3(1.0, 0.3, 0.0));
    const Vec3 otherPushed = 0.3 * (after(1).velocity - Vec3(-0.5, 0.1, 0.2));
    EXPECT_LT((pushed + otherPushed).norm(), 1e-14);
    const Vec3 rubbed = pushed - pushed.dot(normal) * normal;
    const Vec3 turned =
        0.4 * kBallMass * kBallRadius * kBallRadius * (after(0).spin - Vec3(20.0, -30.0, 10.0));
    EXPECT_LT((turned - (-kBallRadius * normal).cross(rubbed)).norm(), 1e-15);
    const Vec3 slip = after(0).velocity + after(0).spin.cross(-kBallRadius * normal) -
                      after(1).velocity - after(1).spin.cross(kBallRadius * normal);
    const Vec3 sliding = slip - slip.dot(normal) * normal;
    if (friction > 1.0) {
      EXPECT_LT(sliding.norm(), 1e-13);
    } else {
      EXPECT_NEAR(rubbed.norm(), friction * impulse, 1e-15);
      EXPECT_LT(sliding.dot(rubbed), 0.0);  // it still slips, against the push
    }
    EXPECT_LT(stepper.kineticEnergy(),
              0.5 * kBallMass * 1.09 + 0.5 * 0.3 * 0.3 +
                  0.2 * (kBallMass + 0.3) * kBallRadius * kBallRadius * 1400.0);
  }
}

TEST(Rolling, AStunnedCueBallStopsAndARollingOneFollows) {
  // The cue ball meets a frictionless ball head on: without spin it stops; if it rolls, it keeps
  // its spin and follows with 2/7 of its speed.
  for (const bool rolling : {false, true}) {
    SphereWorld world = table();
    world.spheres = {ballAt(1, 0.0, 0.0, {1.0, 0.0, 0.0}),
                     ballAt(2, 2.0 * kBallRadius + 1e-3, 0.0, Vec3::Zero())};
    world.spheres[1].friction.sliding = 0.0;
    if (rolling) world.spheres[0].friction.spin = {0.0, 0.0, -1.0 / kBallRadius};
    SphereStepper stepper = stepperOf(world);
    stepper.advanceTo(3.0);
    const double hit = rolling ? 1.0 : std::sqrt(1.0 - 2.0 * 0.2 * kGravity * 1e-3);
    const double spin = rolling ? 1.0 : 2.5 * (1.0 - hit);
    EXPECT_NEAR(stepper.state(0).velocity.x(), 2.0 / 7.0 * spin, 1e-12);
    EXPECT_NEAR(stepper.state(1).velocity.x(), hit, 1e-12);
    EXPECT_TRUE(valid(stepper));
  }
}

// ---- Restitution that depends on speed

TEST(RestitutionLaw, FifthRootIsTheInverseOfTheFifthPower) {
  for (const double root : {1e-30, 0.3, 1.0, 1.7, 2.0, 123.456, 1e30}) {
    const double power = root * root * root * root * root;
    EXPECT_NEAR(fifthRoot(power), root, 1e-15 * root);
  }
  EXPECT_EQ(fifthRoot(0.0), 0.0);
}

TEST(RestitutionLaw, SlowViscoelasticBouncesLoseLittle) {
  // 1 - e ~ v^(1/5), so that from 1 m/s to 1e-5 m/s the loss falls tenfold.
  const RestitutionLaw law{SpeedLaw::viscoelastic, 1.0};
  const double slow = 1.0 / restitutionAt(0.8, law, 1e-5) - 1.0;
  EXPECT_NEAR(slow, 0.1 * (1.0 / 0.8 - 1.0), 1e-12);
  EXPECT_DOUBLE_EQ(restitutionAt(0.8, law, 1.0), 0.8);
  EXPECT_EQ(restitutionAt(0.0, law, 0.5), 0.0);
}

TEST(RestitutionLaw, DroppedBallsBounceByTheirLaw) {
  for (const double height : {0.01, 1.0, 5.0}) {
    for (const SpeedLaw kind : {SpeedLaw::viscoelastic, SpeedLaw::plastic}) {
      SphereWorld world = droppedBall(height, 0.8);
      world.spheres[0].restitutionLaw = {kind, 1.0};
      world.planes[0].restitutionLaw = {kind, 1.0};
      SphereStepper stepper = stepperOf(world);
      const double speed = std::sqrt(2.0 * kGravity * height);
      const double fall = speed / kGravity;
      stepper.advanceTo(fall * 1.0001);
      const double left = stepper.state(0).velocity.y() + kGravity * 0.0001 * fall;
      const double expected = kind == SpeedLaw::viscoelastic
                                  ? 1.0 / (1.0 + 0.25 * std::pow(speed, 0.2))
                                  : 0.8 * std::pow(std::max(speed, 1.0), -0.25);
      EXPECT_NEAR(left / speed, expected, 1e-9);
    }
  }
}

}  // namespace carom::test
