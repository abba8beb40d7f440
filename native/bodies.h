#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "native/contact_time.h"
#include "native/motion.h"
#include "native/sphere_world.h"

namespace carom {

/// A plane as the search for contacts reads it.
struct Wall {
  Plane plane;
  double speed = 0.0;  ///< m/s, along its normal
};

/// The walls that a sphere touches and does not leave: it moves along them, and is not predicted to
/// meet them.
struct Holds {
  static constexpr std::size_t kMost = 3;

  std::array<std::uint32_t, kMost> walls{};
  std::uint32_t count = 0;

  std::span<const std::uint32_t> all() const { return {walls.data(), count}; }
  bool has(std::uint32_t wall) const {
    for (const std::uint32_t held : all()) {
      if (held == wall) return true;
    }
    return false;
  }
};

/// What moves, and in what. Spheres are in order of their ids. Internal to native/.
struct Bodies {
  Vec3 gravity = Vec3::Zero();      ///< m/s^2
  std::vector<Motion> motions;      ///< by sphere
  std::vector<Vec3> accelerations;  ///< m/s^2, by sphere
  std::vector<Holds> holds;         ///< by sphere
  std::vector<double> radii;        ///< m, by sphere
  std::vector<BodyId> ids;          ///< by sphere, ascending
  std::vector<Wall> walls;
  double level = 0.0;     ///< m/s^2: what is less along a normal is rounding
  std::size_t apart = 0;  ///< how many spheres have another acceleration than gravity

  std::size_t count() const { return motions.size(); }  ///< of spheres

  Motion at(std::size_t sphere, const Instant& instant) const {
    return motions[sphere].at(instant, accelerations[sphere]);
  }
  void setAcceleration(std::size_t sphere, const Vec3& acceleration) {
    if (accelerations[sphere] != gravity) --apart;
    accelerations[sphere] = acceleration;
    if (acceleration != gravity) ++apart;
  }

  /// m, from the wall at `instant` to the lowest point of the sphere if it were at `position`.
  double height(std::size_t sphere, const Wall& wall, const Vec3& position,
                const Instant& instant) const {
    const double height =
        dotInOrder(wall.plane.normal, position) - wall.plane.offset - radii[sphere];
    return wall.speed == 0.0 ? height : height - wall.speed * elapsed(Instant{}, instant);
  }
  /// m/s^2, along a normal; 0 where only rounding makes it another.
  double alongNormal(const Vec3& normal, const Vec3& acceleration) const {
    const double along = dotInOrder(normal, acceleration);
    return std::abs(along) > level ? along : 0.0;
  }
};

}  // namespace carom
