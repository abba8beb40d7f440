#pragma once

#include <array>
#include <cstddef>

#include "carom/audio/vector.h"
#include "native/math/contact_time.h"
#include "native/math/vector_math.h"

namespace carom::native {

/// Returns the columns of the rotation by a unit quaternion, in a fixed order of additions: the
/// axes of a box in the world. They are exactly the world's own axes for the identity. [any thread]
std::array<Vec3, 3> columnsOf(const Quat& orientation) noexcept;

/// Returns the components of a world vector along three axes. [any thread]
inline Vec3 along(const std::array<Vec3, 3>& axes, const Vec3& vector) noexcept {
  return {dotInOrder(axes[0], vector), dotInOrder(axes[1], vector), dotInOrder(axes[2], vector)};
}

/// The feature of a box that is nearest to a point.
enum class BoxFeature { inside, face, edge, corner };

/// The position of a sphere's centre relative to a box.
struct BoxNearest {
  BoxFeature feature = BoxFeature::inside;
  double distance = 0.0;       ///< m, from the box's surface; 0 inside
  Vec3 normal = Vec3::Zero();  ///< unit, in the box's frame, towards the centre; zero inside
  std::size_t face = 0;        ///< 2 axis, + 1 on the side where that coordinate is negative
};

/// Returns the nearest feature of a box with these half extents (m, >= 0) around the origin, along
/// the axes. With one half extent of 0 it is a rectangle with two faces, with two a needle, with
/// three a point. A feature with extent in two directions is a face, in one an edge, in none a
/// corner. [any thread]
BoxNearest nearestOf(const Vec3& halfExtents, const Vec3& centre) noexcept;

/// The path of a sphere's centre in the frame of a box: position + velocity t + acceleration t^2/2.
struct BoxPath {
  Vec3 position;      ///< m
  Vec3 velocity;      ///< m/s
  Vec3 acceleration;  ///< m/s^2
};

/// Returns the time in s until a sphere first touches the box; kNever if it does not, or if that is
/// certainly after `until`. `until` has no influence on the bits of any other answer.
///
/// The six planes of the faces divide the path into at most 13 pieces. On each of them the nearest
/// feature is one face, edge or corner, and one polynomial decides: the height over a face (a
/// quadratic, planeContactTime), or the squared distance from an edge or corner (a quartic,
/// firstFall). Every piece counts time and place from its own beginning, so that a distant start
/// costs no digits. The distance is continuous: a fall that rounding hides between two pieces is at
/// their border.
///
/// A sphere that touches or overlaps at the start gets 0 if it approaches, or is at rest and drawn
/// in. Otherwise it leaves first, and comes back to the distance `radius`, or if it never gets that
/// far to its present distance. Finite values, `radius` > 0, and a centre that is not inside. [any
/// thread]
double boxContactTime(const Vec3& halfExtents, const BoxPath& path, double radius,
                      double until = kNever) noexcept;

/// Returns the time until a point leaves the rectangle of the face (numbered as in BoxNearest),
/// whatever its motion across the face; 0 if it is at the border, and moving or drawn out. [any
/// thread]
double faceExitTime(const Vec3& halfExtents, const BoxPath& path, std::size_t face) noexcept;

}  // namespace carom::native
