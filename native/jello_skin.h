#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "carom/audio/vector.h"

namespace carom::native {

/// The outermost squares of a lattice of count^3 points, each in two triangles: where it ends.
/// [any thread]
class JelloSkin {
 public:
  /// x, y and z of each point, m.
  using Places = std::array<const double*, 3>;

  /// Where a ball meets it.
  struct Contact {
    std::array<std::size_t, 3> points{};
    std::array<double, 3> weights{};  ///< of the points, in the place: >= 0, of sum 1
    Vec3 place = Vec3::Zero();        ///< m, the nearest to the middle of the ball
    Vec3 normal = Vec3::UnitX();      ///< unit, outwards, through the middle of the ball
    double depth = 0.0;               ///< m, > 0: the radius less the middle's height above it
  };

  using Square = std::array<std::size_t, 4>;  ///< points in turn, counterclockwise from outside

  explicit JelloSkin(std::size_t count);

  const std::vector<Square>& squares() const { return squares_; }

  /// m^3 inside, by the divergence theorem.
  double volume(const Places& places) const;
  /// Nothing where the ball is outside. Its middle counts as inside where the angle-weighted normal
  /// (Baerentzen, Aanaes 2005) of the nearest place says so.
  std::optional<Contact> meet(const Places& places, const Vec3& middle, double radius) const;

 private:
  std::vector<Square> squares_;
};

}  // namespace carom::native
