#pragma once

#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "carom/audio/vector.h"

class btCollisionShape;

namespace carom::bench {

/// Where a body is and how it is turned.
struct Placement {
  Vec3 position = Vec3::Zero();
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
};

/// A convex solid: the hull of some points, or a cylinder about the axis y, rounded.
struct Core {
  std::vector<Vec3> points;
  std::vector<std::pair<std::size_t, std::size_t>> edges;  ///< and diagonals of faces, no matter
  std::vector<std::array<std::size_t, 3>> triangles;       ///< seen from outside, anticlockwise
  std::optional<std::pair<double, double>> cylinder;       ///< m, radius and half height
  double rounding = 0.0;                                   ///< m, around all of it
};

/// One convex part of a shape as Bullet collides it. Its narrow phase has more than one surface for
/// some: a box is sharp against boxes and planes, and a smaller one rounded by its margin against
/// the rest.
struct ReferencePart {
  Placement place;  ///< in the frame of the body
  Core core;
  std::optional<Vec3> sharpBox;  ///< m, half extents
};

/// The surface of a Bullet shape, for the reference: read once, then nothing is asked of Bullet.
struct ReferenceShape {
  std::vector<ReferencePart> parts;
  std::optional<std::pair<Vec3, double>> plane;  ///< instead: normal and offset, static
  double reach = 0.0;  ///< m, farthest point from the body's centre, without the rounding

  /// Sphere, box, capsule, cylinder (both about y), convex hull, compound, static plane.
  static ReferenceShape of(const btCollisionShape& shape);
};

/// m, smallest distance of two shapes; negative where they overlap. Between general shapes it is by
/// trying all features of the one on all of the other: slow and obvious. Where it is not the
/// distance (two boxes, corner to corner) it is less, and has the same zero.
double gapOf(const ReferenceShape& first, const Placement& firstPlace, const ReferenceShape& second,
             const Placement& secondPlace);

}  // namespace carom::bench
