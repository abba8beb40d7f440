#pragma once

#include <array>
#include <cstddef>

#include "carom/audio/vector.h"
#include "native/contact_time.h"
#include "native/vector_math.h"

namespace carom::native {

/// The columns of the rotation by a unit quaternion, in fixed order of additions: the axes of a box
/// in the world. Exactly the world's own for the identity. [any thread]
std::array<Vec3, 3> columnsOf(const Quat& orientation) noexcept;

/// The components of a vector of the world along three axes. [any thread]
inline Vec3 along(const std::array<Vec3, 3>& axes, const Vec3& vector) noexcept {
  return {dotInOrder(axes[0], vector), dotInOrder(axes[1], vector), dotInOrder(axes[2], vector)};
}

/// What of a box a sphere is nearest to.
enum class BoxFeature { inside, face, edge, corner };

/// Where a sphere's centre is with respect to a box.
struct BoxNearest {
  BoxFeature feature = BoxFeature::inside;
  double distance = 0.0;       ///< m, from the box's surface; 0 inside
  Vec3 normal = Vec3::Zero();  ///< unit, in the box's frame, towards the centre; zero inside
  std::size_t face = 0;        ///< 2 axis, + 1 on the side where that coordinate is negative
};

/// Of a box of these half extents (m, >= 0) around the origin, along the axes. With one of them 0
/// it is a rectangle with two faces, with two a needle, with three a point: what has no width in
/// one direction is an edge, in two a corner. [any thread]
BoxNearest nearestOf(const Vec3& halfExtents, const Vec3& centre) noexcept;

/// The path of a sphere's centre in the frame of a box: position + velocity t + acceleration t^2/2.
struct BoxPath {
  Vec3 position;      ///< m
  Vec3 velocity;      ///< m/s
  Vec3 acceleration;  ///< m/s^2
};

/// Time until a sphere first touches the box, s from now; kNever if it does not, or if that is
/// certainly after `until`. `until` has no influence on the bits of any other answer.
///
/// The six planes of the faces divide the path into at most 13 pieces. On each of them the nearest
/// feature is one face, edge or corner, and what decides is one polynomial: the height over a face
/// (a quadratic, planeContactTime), the square of the distance from an edge or corner (a quartic,
/// firstFall). Every piece counts time and place from its own beginning, so that a distant start
/// costs no digits. The distance is continuous: a fall that rounding hides between two pieces is
/// at their border.
///
/// What touches or overlaps at the start: 0 if it approaches, or is at rest and drawn in. Otherwise
/// it leaves first, and comes back to `radius`, or if it never gets that far to the distance that
/// it has now. Finite values, `radius` > 0, and a centre that is not inside. [any thread]
double boxContactTime(const Vec3& halfExtents, const BoxPath& path, double radius,
                      double until = kNever) noexcept;

/// Time until a point leaves the rectangle of the face (numbered as in BoxNearest), whatever it
/// does across it; 0 if it is at the border, and moving or drawn out. [any thread]
double faceExitTime(const Vec3& halfExtents, const BoxPath& path, std::size_t face) noexcept;

}  // namespace carom::native
