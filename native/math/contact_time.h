#pragma once

#include <cmath>
#include <limits>

#include "carom/audio/vector.h"
#include "native/math/polynomial.h"
#include "native/math/vector_math.h"

namespace carom::native {

/// Time (s) of a contact that does not happen.
inline constexpr double kNever = std::numeric_limits<double>::infinity();

/// Returns the time in s until two spheres in straight relative motion first touch; kNever if they
/// do not. It is the smaller root of a t^2 + 2 b t + c = 0 with a = v.v, b = d.v, c = d.d - R^2.
///
/// Two bodies in free flight under the same uniform gravity move in this way, and the result is
/// then exact. The root is taken as c / q with q = -b + sqrt(D), a sum of two positive numbers. D =
/// b^2 - a c is evaluated as a R^2 - |d x v|^2 (Lagrange's identity) in factors, so that neither a
/// distant start nor a nearly grazing pass costs digits beyond those of d and v themselves.
///
/// - separating, or at relative rest: kNever, whether the spheres touch or not
/// - touching or overlapping and approaching: 0
/// - grazing, D = 0: the time of closest approach
///
/// `separation` d: m, from the centre of the one to the centre of the other; `relativeVelocity` v:
/// m/s, its rate of change; `radiusSum` R: m, > 0. Finite values, and speeds whose square does not
/// underflow (> 1e-150 m/s). [any thread]
inline double sphereContactTime(const Vec3& separation, const Vec3& relativeVelocity,
                                double radiusSum) noexcept {
  const double closing = -dotInOrder(separation, relativeVelocity);
  if (!(closing > 0.0)) return kNever;
  const double squared = dotInOrder(separation, separation);
  const double gap = squared - radiusSum * radiusSum;
  if (gap <= 0.0) return 0.0;
  const double speed = dotInOrder(relativeVelocity, relativeVelocity);
  // Most spheres pass at a distance: b^2 - a c tells so at once, by more than its rounding.
  if (closing * closing < speed * (gap - 1e-9 * squared)) return kNever;
  const Vec3 moment = cross(separation, relativeVelocity);
  const double reach = radiusSum * radiusSum * speed;
  const double miss = dotInOrder(moment, moment);
  if (miss > reach) return kNever;
  return gap / (closing + std::sqrt(reach - miss));
}

/// Returns the time in s until two spheres first touch whose accelerations differ by the constant
/// `acceleration` (m/s^2): the first time at which their squared distance falls through R^2, a
/// quartic in time. Spheres that touch or overlap and are neither approaching nor accelerated in
/// leave first, and come back to R, or if they never get that far to their present overlap. kNever
/// also if the time is after `until` s. Other arguments as in the overload above. [any
/// thread]
inline double sphereContactTime(const Vec3& separation, const Vec3& relativeVelocity,
                                const Vec3& acceleration, double radiusSum, double until) noexcept {
  const double gap = dotInOrder(separation, separation) - radiusSum * radiusSum;
  const double closing = dotInOrder(separation, relativeVelocity);
  const double bend =
      dotInOrder(relativeVelocity, relativeVelocity) + dotInOrder(separation, acceleration);
  if (gap <= 0.0 && (closing < 0.0 || (closing == 0.0 && bend < 0.0))) return 0.0;
  Quartic distance{gap, 2.0 * closing, bend, dotInOrder(relativeVelocity, acceleration),
                   0.25 * dotInOrder(acceleration, acceleration)};
  const double wait = firstFall(distance, 0.0, until);
  if (wait < kNever || gap >= 0.0) return wait;
  distance[0] = 0.0;
  return firstFall(distance, 0.0, until);
}

/// Returns the time in s until a point at `height` above a surface, moving with `velocity` along
/// the normal under the constant `acceleration`, reaches the surface from above; kNever if it does
/// not. It is the smallest fitting root of a t^2 / 2 + v t + h = 0, in the form without
/// cancellation. For a sphere and a plane the height is that of the sphere's lowest point.
///
/// At or below the surface (rounding leaves a body just below it after a bounce):
/// - approaching: 0
/// - at rest: 0 when it is accelerated in, otherwise kNever
/// - leaving: the time of its return to the surface, kNever when it is not accelerated in. A body
///   too slow to come out returns to the height it has now, after 2 v / |a|, so that a contact
///   which has been resolved is never found again at once.
///
/// Arguments in m, m/s and m/s^2, positive along the normal; finite. [any thread]
inline double planeContactTime(double height, double velocity, double acceleration) noexcept {
  const bool touching = height <= 0.0;
  if (touching && velocity < 0.0) return 0.0;
  const bool pulledIn = acceleration < 0.0;
  if (velocity >= 0.0 && !pulledIn) return kNever;

  const double discriminant = velocity * velocity - 2.0 * acceleration * height;
  if (velocity < 0.0) {
    if (discriminant < 0.0) return kNever;  // turned round above the surface
    return 2.0 * height / (std::sqrt(discriminant) - velocity);
  }
  if (discriminant < 0.0) return 2.0 * velocity / -acceleration;  // below the surface, and too slow
  return (velocity + std::sqrt(discriminant)) / -acceleration;
}

}  // namespace carom::native
