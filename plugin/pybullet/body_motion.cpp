#include "plugin/pybullet/body_motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace carom::plugin {
namespace {

// m/s, and share of the speed: rounding, and the damping of a second's hundredth.
constexpr double kDisagreement = 0.02;
constexpr double kDisagreementShare = 0.05;

/// rad: Bullet turns a body that would turn further than this within a substep, by an angle a, less
/// far: by an angle b with tan(b / 2) = a / kLargestTurn * tan(kLargestTurn / 2)
/// (btTransformUtil::integrateTransform).
constexpr double kLargestTurn = 0.25 * std::numbers::pi;

/// Angular velocity (rad/s) with which Bullet turns one orientation into another.
Vec3 turningFrom(const Quat& from, const Quat& to, double duration) {
  Quat turn = to * from.conjugate();
  if (turn.w() < 0.0) turn.coeffs() = -turn.coeffs();
  const double sine = turn.vec().norm();
  if (!(sine > 0.0)) return Vec3::Zero();
  double angle = 2.0 * std::atan2(sine, turn.w());
  if (angle > kLargestTurn) angle = kLargestTurn * (sine / turn.w()) / std::tan(0.5 * kLargestTurn);
  return turn.vec() * (angle / (sine * duration));
}

/// Orientation after turning for so long (s); below 0: before.
Quat turned(const Quat& from, const Vec3& angularVelocity, double duration) {
  const double speed = angularVelocity.norm();
  if (!(speed > 0.0)) return from;
  return Quat(Eigen::AngleAxisd(speed * duration, angularVelocity / speed)) * from;
}

}  // namespace

BodyState endOf(const BodyState& start, const Vec3& position, const Quat& orientation,
                double duration) {
  return {position, orientation, (position - start.position) / duration,
          turningFrom(start.orientation, orientation, duration)};
}

bool isFreeMotion(const BodyState& start, const BodyState& end, const Vec3& impulse, double mass,
                  const FreeMotion& motion) {
  const Vec3 expected = start.velocity + motion.duration * motion.gravity + impulse / mass;
  const double speed = std::max(start.velocity.norm(), end.velocity.norm());
  return (end.velocity - expected).norm() <= kDisagreement + kDisagreementShare * speed;
}

BodyState startOf(const BodyState& end, const BodyMotion& motion, const ContactBody& body,
                  const FreeMotion& free) {
  BodyState start;
  start.position = end.position - free.duration * end.velocity;
  start.orientation = turned(end.orientation, end.angularVelocity, -free.duration);
  start.velocity = end.velocity - free.duration * free.gravity - motion.impulse / body.mass;
  Vec3 turn = start.orientation.conjugate() * motion.angularImpulse;
  for (int axis = 0; axis < 3; ++axis)
    turn[axis] = body.inertia[axis] > 0.0 ? turn[axis] / body.inertia[axis] : 0.0;
  start.angularVelocity = end.angularVelocity - start.orientation * turn;
  return start;
}

}  // namespace carom::plugin
