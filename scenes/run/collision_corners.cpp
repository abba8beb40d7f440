#include "scenes/run/collision_corners.h"

#include <algorithm>
#include <limits>

#include <LinearMath/btConvexHullComputer.h>

namespace carom::scenes {
namespace {

/// A convex hull by Bullet's computer. That rounds coordinates, so its corners are not used, but
/// the points that they come from.
class Hull {
 public:
  explicit Hull(const std::vector<Vec3>& points) {
    std::vector<double> coordinates;
    for (const Vec3& point : points)
      coordinates.insert(coordinates.end(), {point.x(), point.y(), point.z()});
    computer_.compute(coordinates.data(), 3 * static_cast<int>(sizeof(double)),
                      static_cast<int>(points.size()), btScalar(0), btScalar(0));
    for (int corner = 0; corner < computer_.original_vertex_index.size(); ++corner)
      corners_.push_back(points[static_cast<std::size_t>(computer_.original_vertex_index[corner])]);
    for (const Vec3& corner : corners_)
      middle_ += corner / static_cast<double>(corners_.size());
    for (int face = 0; face < computer_.faces.size(); ++face)
      addFace(computer_.faces[face]);
  }

  const std::vector<Vec3>& corners() const { return corners_; }

  /// Height of the point in m above the face that it is
  /// farthest outside of; negative inside the hull.
  double heightOf(const Vec3& point) const {
    double height = -std::numeric_limits<double>::infinity();
    for (const Face& face : faces_)
      height = std::max(height, face.normal.dot(point) - face.offset);
    return height;
  }

 private:
  struct Face {
    Vec3 normal;    // unit, outward
    double offset;  // m
  };

  /// Adds the plane of a face by Newell's sum over the edges, which tolerates edges that are short
  /// or in line.
  void addFace(int first) {
    const btConvexHullComputer::Edge* const start = &computer_.edges[first];
    const auto corner = [this](int index) { return corners_[static_cast<std::size_t>(index)]; };
    Vec3 area = Vec3::Zero();
    const Vec3 origin = corner(start->getSourceVertex());
    const btConvexHullComputer::Edge* edge = start;
    do {
      area += (corner(edge->getSourceVertex()) - origin)
                  .cross(corner(edge->getTargetVertex()) - origin);
      edge = edge->getNextEdgeOfFace();
    } while (edge != start);
    if (!(area.norm() > 0.0)) return;
    Vec3 normal = area.normalized();
    if (normal.dot(origin - middle_) < 0.0) normal = -normal;
    faces_.push_back({normal, normal.dot(origin)});
  }

  btConvexHullComputer computer_;
  std::vector<Vec3> corners_;
  Vec3 middle_ = Vec3::Zero();
  std::vector<Face> faces_;
};

/// Returns eight points far from each other: each is the one farthest from those before it.
std::vector<Vec3> spreadOf(const std::vector<Vec3>& points) {
  constexpr std::size_t kBegin = 8;
  std::vector<Vec3> chosen = {points.front()};
  std::vector<double> distances(points.size(), std::numeric_limits<double>::infinity());
  while (chosen.size() < kBegin) {
    for (std::size_t index = 0; index < points.size(); ++index)
      distances[index] = std::min(distances[index], (points[index] - chosen.back()).norm());
    const auto farthest = std::ranges::max_element(distances);
    chosen.push_back(points[static_cast<std::size_t>(farthest - distances.begin())]);
  }
  return chosen;
}

}  // namespace

std::vector<Vec3> collisionCorners(const std::vector<Vec3>& points, std::size_t most) {
  std::vector<Vec3> all = Hull(points).corners();
  if (all.size() <= most) return all;
  std::vector<Vec3> chosen = spreadOf(all);
  while (chosen.size() < most) {
    const Hull hull(chosen);
    const auto higher = [&hull](const Vec3& point, const Vec3& other) {
      return hull.heightOf(point) < hull.heightOf(other);
    };
    chosen.push_back(*std::ranges::max_element(all, higher));
  }
  return Hull(chosen).corners();
}

}  // namespace carom::scenes
