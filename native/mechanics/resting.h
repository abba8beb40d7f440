#pragma once

#include <cstddef>
#include <span>

#include "carom/audio/vector.h"

namespace carom::native {

/// Largest number of surfaces for carriedBy: more than the 12 equal spheres that may surround one.
inline constexpr std::size_t kMostSurfaces = 24;

/// The motion of a sphere that touches immovable surfaces and does not leave them.
struct Carried {
  Vec3 acceleration;      ///< m/s^2, leads into none of the surfaces
  unsigned touching = 0;  ///< bit k: the sphere does not leave surface k
};

/// Returns the acceleration nearest to `pull` that leads into none of the surfaces: the result of
/// frictionless contact forces, which only push (Gauss's principle of least constraint). It is zero
/// if the surfaces carry the sphere. All choices of up to three surfaces are tried, the fewest
/// first. `normals` are at most kMostSurfaces unit vectors, towards the sphere. A component within
/// the rounding of the pull counts as zero: a surface along which the sphere is merely drawn counts
/// as touched. [any thread]
Carried carriedBy(const Vec3& pull, std::span<const Vec3> normals);

/// Returns the velocity of a sphere that all the surfaces hold: its components along their normals
/// become `speeds` (m/s), the rest of `velocity` remains. [any thread]
Vec3 heldVelocity(const Vec3& velocity, std::span<const Vec3> normals,
                  std::span<const double> speeds);

}  // namespace carom::native
