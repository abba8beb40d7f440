#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "carom/audio/vector.h"

namespace carom::native {

/// The surface of a lattice of count^3 points: its outermost squares, each in two triangles. [any
/// thread]
class JelloSkin {
 public:
  /// Arrays of x, y and z (m) of the points.
  using Places = std::array<const double*, 3>;

  /// The contact of a ball with the skin.
  struct Contact {
    std::array<std::size_t, 3> points{};
    std::array<double, 3> weights{};  ///< shares of the points in `place`: >= 0, with sum 1
    Vec3 place = Vec3::Zero();        ///< m, place of the skin nearest to the centre of the ball
    Vec3 normal = Vec3::UnitX();      ///< unit, outwards, through the centre of the ball
    double depth = 0.0;               ///< m, > 0: radius less the centre's height above the skin
  };

  using Square = std::array<std::size_t, 4>;  ///< points in turn, counterclockwise from outside

  explicit JelloSkin(std::size_t count);

  const std::vector<Square>& squares() const { return squares_; }

  /// Enclosed volume in m^3, by the divergence theorem.
  double volume(const Places& places) const;
  /// Returns the contact of a ball; nothing if the ball is outside. Its centre counts as inside if
  /// the angle-weighted normal (Baerentzen, Aanaes 2005) of the nearest place says so.
  std::optional<Contact> meet(const Places& places, const Vec3& middle, double radius) const;

 private:
  std::vector<Square> squares_;
};

}  // namespace carom::native
