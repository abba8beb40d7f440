#include "bullet_bridge/rigid_motion.h"

namespace carom {

Pose RigidMotion::poseAt(double s) const {
  const double angle = s * angularVelocity.norm();
  if (angle == 0.0) return {centre.positionAt(s), orientation.toRotationMatrix()};
  const Quat turn(Eigen::AngleAxisd(angle, angularVelocity.normalized()));
  return {centre.positionAt(s), (turn * orientation).toRotationMatrix()};
}

}  // namespace carom
