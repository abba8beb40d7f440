#pragma once

#include "bullet_bridge/geometry/motion.h"
#include "carom/audio/vector.h"

namespace carom::bullet {

struct Pose {
  Vec3 position = Vec3::Zero();                            ///< m, world frame
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< body to world
  Vec3 toWorld(const Vec3& local) const { return position + rotation * local; }
  Vec3 toLocal(const Vec3& world) const { return rotation.transpose() * (world - position); }
};

/// Motion of a rigid body within one substep: its centre as in Motion, its orientation at constant
/// angular velocity, which is how Bullet takes it from one node to the next.
struct RigidMotion {
  Motion centre;
  Quat orientation = Quat::Identity();  ///< body to world, at s = 0
  Vec3 angularVelocity = Vec3::Zero();  ///< rad/s, world frame

  Quat orientationAt(double s) const;
  Pose poseAt(double s) const;
  /// Velocity (m/s, world frame) of the body's material point at `point` (m, world frame).
  Vec3 velocityAt(const Vec3& point, double s) const {
    return centre.velocityAt(s) + angularVelocity.cross(point - centre.positionAt(s));
  }
};

}  // namespace carom::bullet
