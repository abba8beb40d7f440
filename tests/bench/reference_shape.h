#pragma once

#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "carom/audio/vector.h"

class btCollisionShape;

namespace carom::bench {

/// The position and orientation of a body.
struct Placement {
  Vec3 position = Vec3::Zero();
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
};

/// A convex solid: the hull of some points, or a cylinder about the axis y, rounded.
struct Core {
  std::vector<Vec3> points;
  std::vector<std::pair<std::size_t, std::size_t>> edges;  ///< diagonals of faces may be among them
  std::vector<std::array<std::size_t, 3>> triangles;       ///< anticlockwise, seen from outside
  std::optional<std::pair<double, double>> cylinder;       ///< m, radius and half height
  double rounding = 0.0;                                   ///< m, added all around
};

/// One convex part of a shape as Bullet collides it. Bullet's narrow phase gives some shapes more
/// than one surface: a box is sharp against boxes and planes, and against the rest a smaller one,
/// rounded by its margin.
struct ReferencePart {
  Placement place;  ///< in the frame of the body
  Core core;
  std::optional<Vec3> sharpBox;  ///< m, half extents of a box, where it is sharp
};

/// The surface of a Bullet shape, for the reference; it is read once, and Bullet is not asked
/// again.
struct ReferenceShape {
  std::vector<ReferencePart> parts;
  std::optional<std::pair<Vec3, double>> plane;  ///< a static plane instead: normal and offset
  double reach = 0.0;  ///< m, farthest point from the body's centre, without the rounding

  /// Reads a sphere, box, capsule, cylinder (both about y), convex hull, compound or static plane.
  static ReferenceShape of(const btCollisionShape& shape);
};

/// Smallest distance of two shapes in m; negative if they overlap. Between general shapes all
/// features of the one are tried on all of the other, which is slow and obvious. Where the result
/// is not the distance (two boxes, corner to corner) it is less and has the same zero.
double gapOf(const ReferenceShape& first, const Placement& firstPlace, const ReferenceShape& second,
             const Placement& secondPlace);

}  // namespace carom::bench
