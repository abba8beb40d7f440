#include "bullet_bridge/geometry/rigid_motion.h"

namespace carom::bullet {

Quat RigidMotion::orientationAt(double s) const {
  const double angle = s * angularVelocity.norm();
  if (angle == 0.0) return orientation;
  return Quat(Eigen::AngleAxisd(angle, angularVelocity.normalized())) * orientation;
}

Pose RigidMotion::poseAt(double s) const {
  return {centre.positionAt(s), orientationAt(s).toRotationMatrix()};
}

}  // namespace carom::bullet
