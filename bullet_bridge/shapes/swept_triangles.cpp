#include "bullet_bridge/shapes/swept_triangles.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace carom::bullet {

MeshFrameBox meshFrameBox(const ConvexPiece& piece, const RigidMotion& body,
                          const RigidMotion& meshBody, const Eigen::Matrix3d& meshRotation,
                          const Vec3& meshOffset, double horizon) {
  const auto seenFromMesh = [&](double s) {
    const Pose pose = meshBody.poseAt(s);
    const Vec3 apart = (body.centre - meshBody.centre).positionAt(s);
    return Vec3(meshRotation.transpose() * (pose.rotation.transpose() * apart - meshOffset));
  };
  const Vec3 start = seenFromMesh(0.0);
  const Vec3 end = seenFromMesh(horizon);

  // In between, the centre leaves the straight line by its acceleration as the mesh sees it.
  const Motion relative = body.centre - meshBody.centre;
  const double turning = meshBody.angularVelocity.norm();
  const double speed = relative.velocity.norm() + horizon * relative.acceleration.norm();
  const double far = relative.position.norm() + horizon * speed;
  const double bend = relative.acceleration.norm() + turning * (2.0 * speed + turning * far);
  const double sagitta = 0.125 * horizon * horizon * bend;

  // The piece also turns around that centre.
  const double turned = std::min(horizon * (body.angularVelocity.norm() + turning), 2.0);
  const double slack = sagitta + piece.margin() + turned * piece.coreReach();

  const Eigen::Matrix3d rotation = meshRotation.transpose() *
                                   meshBody.poseAt(0.0).rotation.transpose() *
                                   body.poseAt(0.0).rotation;
  MeshFrameBox box;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Vec3 direction = rotation.transpose() * Vec3::Unit(axis);
    const auto extent = [&](const Vec3& way) {
      return way.dot(piece.offset() +
                     piece.rotation() * piece.support(piece.rotation().transpose() * way));
    };
    box.low[axis] = std::min(start[axis], end[axis]) - extent(-direction) - slack;
    box.high[axis] = std::max(start[axis], end[axis]) + extent(direction) + slack;
  }
  return box;
}

bool mayReachInto(const std::array<Vec3, 3>& triangle, const MeshFrameBox& box) {
  const Vec3 low = triangle[0].cwiseMin(triangle[1]).cwiseMin(triangle[2]);
  const Vec3 high = triangle[0].cwiseMax(triangle[1]).cwiseMax(triangle[2]);
  if ((low.array() > box.high.array()).any() || (high.array() < box.low.array()).any()) {
    return false;
  }
  const Vec3 normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
  const double height = normal.dot(0.5 * (box.low + box.high) - triangle[0]);
  return !(std::abs(height) > 0.5 * normal.cwiseAbs().dot(box.high - box.low));
}

btVector3 roundedOutwards(const Vec3& corner, bool up) {
  btVector3 rounded(0, 0, 0);  // its fourth component, too
  for (int axis = 0; axis < 3; ++axis) {
    const auto value = static_cast<btScalar>(corner[axis]);
    const btScalar step = std::numeric_limits<btScalar>::epsilon() * std::abs(value);
    rounded[axis] = up ? value + step : value - step;
  }
  return rounded;
}

}  // namespace carom::bullet
