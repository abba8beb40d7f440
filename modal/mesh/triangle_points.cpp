#include "modal/mesh/triangle_points.h"

#include <algorithm>
#include <limits>

namespace carom::modal {
namespace {

// Barycentric coordinates of the foot of the perpendicular in the plane; all at least 0 if it is in
// the triangle.
Vec3 footInPlane(const std::array<Vec3, 3>& corners, const Vec3& point) {
  const Vec3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  const auto share = [&](const Vec3& from, const Vec3& to) {
    return (to - from).cross(point - from).dot(normal) / normal.squaredNorm();
  };
  return {share(corners[1], corners[2]), share(corners[2], corners[0]),
          share(corners[0], corners[1])};
}

}  // namespace

Vec3 closestOnTriangle(const std::array<Vec3, 3>& corners, const Vec3& point) {
  Vec3 foot = footInPlane(corners, point);
  if (foot.minCoeff() >= 0.0) return foot;
  Vec3 closest = Vec3::Zero();
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t edge = 0; edge < 3; ++edge) {
    const std::size_t next = (edge + 1) % 3;
    const Vec3 along = corners[next] - corners[edge];
    const double share =
        std::clamp((point - corners[edge]).dot(along) / along.squaredNorm(), 0.0, 1.0);
    const double distance = (corners[edge] + share * along - point).squaredNorm();
    if (distance >= least) continue;
    least = distance;
    closest.setZero();
    closest[static_cast<Eigen::Index>(edge)] = 1.0 - share;
    closest[static_cast<Eigen::Index>(next)] = share;
  }
  return closest;
}

}  // namespace carom::modal
