#pragma once

#include <cstddef>
#include <span>

#include "carom/audio/vector.h"

namespace carom::native {

/// At most so many surfaces are looked at: one sphere has at most 12 equal neighbours.
inline constexpr std::size_t kMostSurfaces = 24;

/// How a sphere moves that touches immovable surfaces and does not leave them.
struct Carried {
  Vec3 acceleration;      ///< m/s^2: nowhere into a surface
  unsigned touching = 0;  ///< bit k: surface k is not left
};

/// The acceleration nearest to `pull` that leads into none of the surfaces: what frictionless
/// contact forces, which only push, make of it (Gauss's principle of least constraint). Zero where
/// they carry it. Found by trying all choices of up to three surfaces, the fewest first. At most
/// kMostSurfaces unit normals, towards the sphere. What is below `tolerance` of the pull is
/// rounding: a surface along which the sphere is merely drawn counts as touched. [any thread]
Carried carriedBy(const Vec3& pull, std::span<const Vec3> normals);

/// The velocity, less what points into or out of the surfaces, which have `speeds` m/s along their
/// normals: what remains of it while all of them are held. [any thread]
Vec3 heldVelocity(const Vec3& velocity, std::span<const Vec3> normals,
                  std::span<const double> speeds);

}  // namespace carom::native
