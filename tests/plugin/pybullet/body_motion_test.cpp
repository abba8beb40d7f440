#include "plugin/pybullet/body_motion.h"

#include <limits>

#include <Eigen/Geometry>
#include <LinearMath/btTransformUtil.h>
#include <gtest/gtest.h>

namespace carom {

using namespace plugin;

namespace {

constexpr double kTick = 1.0 / 240.0;

BodyState someState() {
  return {{0.3, -2.0, 1.5}, Quat(0.6, 0.0, 0.8, 0.0), {1.0, -4.0, 2.0}, {3.0, -7.0, 11.0}};
}

/// Moves a body as Bullet's solver does: by the velocities that the substep ends with.
BodyState moved(BodyState state, const Vec3& velocity, const Vec3& angularVelocity) {
  state.velocity = velocity;
  state.angularVelocity = angularVelocity;
  state.position += kTick * velocity;
  const double speed = angularVelocity.norm();
  state.orientation =
      Quat(Eigen::AngleAxisd(speed * kTick, angularVelocity / speed)) * state.orientation;
  return state;
}

TEST(BodyMotion, VelocitiesFollowFromPlaces) {
  const BodyState start = someState();
  for (const double sign : {1.0, -1.0}) {
    const BodyState end = moved(start, {-3.0, 0.5, 9.0}, {20.0, -5.0, 40.0});
    Quat told = end.orientation;
    told.coeffs() *= sign;  // the same orientation
    const BodyState found = endOf(start, end.position, told, kTick);
    EXPECT_LT((found.velocity - end.velocity).norm(), 1e-11);
    EXPECT_LT((found.angularVelocity - end.angularVelocity).norm(), 1e-11);
    EXPECT_EQ(found.position, end.position);
  }
  const BodyState still = endOf(start, start.position, start.orientation, kTick);
  EXPECT_EQ(still.velocity, Vec3::Zero());
  EXPECT_EQ(still.angularVelocity, Vec3::Zero());
}

// Bullet limits how far a body turns within a substep.
TEST(BodyMotion, FastTurnsFollowFromPlacesAsBulletMakesThem) {
  for (const double speed : {10.0, 40.0, 47.0, 48.0, 60.0, 90.0}) {
    constexpr double kLongTick = 1.0 / 60.0;
    const Vec3 angularVelocity = speed * Vec3(0.6, -0.8, 0.0);
    const btVector3 turning(btScalar(angularVelocity.x()), btScalar(angularVelocity.y()), 0);
    btTransform from = btTransform::getIdentity();
    from.setRotation(btQuaternion(btScalar(0), btScalar(0.8), btScalar(0), btScalar(0.6)));
    btTransform to;
    btTransformUtil::integrateTransform(from, btVector3(0, 0, 0), turning, btScalar(kLongTick), to);
    const btQuaternion turned = to.getRotation();
    const Quat end(static_cast<double>(turned.w()), static_cast<double>(turned.x()),
                   static_cast<double>(turned.y()), static_cast<double>(turned.z()));
    BodyState start;
    start.orientation = Quat(0.6, 0.0, 0.8, 0.0);
    const BodyState found = endOf(start, Vec3::Zero(), end.normalized(), kLongTick);
    EXPECT_LT((found.angularVelocity - angularVelocity).norm(), 2e-4) << speed;
  }
}

TEST(BodyMotion, StartOfASubstepIsThatBeforeItsImpulses) {
  const BodyState start = someState();
  const ContactBody body{.mass = 0.4, .inertia = {0.001, 0.002, 0.003}};
  const FreeMotion free{kTick, {0.0, 0.0, -9.81}};
  BodyMotion motion;
  motion.impulse = {0.2, -0.1, 1.5};
  motion.angularImpulse = Vec3(0.01, 0.02, -0.03).cross(motion.impulse);
  const Eigen::Matrix3d turn = start.orientation.toRotationMatrix();
  const Eigen::Matrix3d inverseInertia =
      turn * body.inertia.cwiseInverse().asDiagonal() * turn.transpose();
  const BodyState end =
      moved(start, start.velocity + kTick * free.gravity + motion.impulse / body.mass,
            start.angularVelocity + inverseInertia * motion.angularImpulse);
  const BodyState found = startOf(end, motion, body, free);
  EXPECT_LT((found.position - start.position).norm(), 1e-12);
  EXPECT_LT(found.orientation.angularDistance(start.orientation), 1e-7);
  EXPECT_LT((found.velocity - start.velocity).norm(), 1e-11);
  EXPECT_LT((found.angularVelocity - start.angularVelocity).norm(), 1e-10);
}

TEST(BodyMotion, WhatGravityAndContactsExplainIsFree) {
  const BodyState start = someState();
  const FreeMotion free{kTick, {0.0, 0.0, -9.81}};
  const Vec3 impulse(0.0, 0.0, 2.0);
  const auto ends = [&](const Vec3& velocity) { return moved(start, velocity, {1.0, 0.0, 0.0}); };
  const Vec3 falls = start.velocity + kTick * free.gravity;
  constexpr double kUnknown = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(isFreeMotion(start, ends(falls), Vec3::Zero(), kUnknown, free));
  EXPECT_TRUE(isFreeMotion(start, ends(0.999 * falls), Vec3::Zero(), kUnknown, free));
  EXPECT_TRUE(isFreeMotion(start, ends(falls + impulse / 0.5), impulse, 0.5, free));
  EXPECT_FALSE(isFreeMotion(start, ends(falls + impulse / 0.5), Vec3::Zero(), kUnknown, free));
  EXPECT_FALSE(isFreeMotion(start, ends(Vec3::Zero()), Vec3::Zero(), kUnknown, free));
}

}  // namespace
}  // namespace carom
