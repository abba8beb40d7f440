#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "carom/native/motion.h"
#include "carom/native/sphere_world.h"
#include "native/math/vector_math.h"
#include "native/scheduling/box_contact.h"
#include "native/scheduling/oscillation.h"

namespace carom::native {

/// A plane or a face of a box, as the search for contacts reads it.
struct Wall {
  Plane plane;
  double speed = 0.0;                  ///< m/s, steady, along the normal
  NormalOscillation oscillation = {};  ///< added to the steady motion of planes that oscillate
  std::uint32_t box = kNoBox;          ///< the box whose face it is

  static constexpr std::uint32_t kNoBox = 0xFFFFFFFF;

  bool oscillates() const { return oscillation.amplitude != 0.0; }
};

/// A box as the search for contacts reads it.
struct Solid {
  Box box;
  std::array<Vec3, 3> axes;     ///< unit, world frame
  double reach = 0.0;           ///< m, from the centre to the farthest corner
  std::uint32_t firstFace = 0;  ///< index of the first of six walls, numbered as in BoxNearest

  Vec3 centreAt(const Instant& instant) const {
    return box.centre + elapsed(Instant{}, instant) * box.velocity;
  }
  Vec3 toWorld(const Vec3& vector) const {
    return vector.x() * axes[0] + vector.y() * axes[1] + vector.z() * axes[2];
  }
};

/// The walls that hold a sphere: it touches them and does not leave them, moves along them, and is
/// not predicted to meet them.
struct Holds {
  static constexpr std::size_t kMost = 3;
  static constexpr std::uint32_t kFaces = 6;  ///< faces of a box
  static constexpr std::uint32_t kNone = 0xFFFFFFFF;

  std::array<std::uint32_t, kMost> walls{};
  std::uint32_t count = 0;

  std::span<const std::uint32_t> all() const { return {walls.data(), count}; }
  bool has(std::uint32_t wall) const {
    for (const std::uint32_t held : all()) {
      if (held == wall) return true;
    }
    return false;
  }
  /// The held wall among the six faces from `firstFace` on, or kNone.
  std::uint32_t faceOf(std::uint32_t firstFace) const {
    for (const std::uint32_t held : all()) {
      if (held >= firstFace && held < firstFace + kFaces) return held;
    }
    return kNone;
  }
  void drop(std::uint32_t wall) {
    std::uint32_t kept = 0;
    for (std::uint32_t k = 0; k < count; ++k) {
      if (walls[k] != wall) walls[kept++] = walls[k];
    }
    count = kept;
  }
};

/// The moving spheres and the walls and boxes around them. Spheres are in order of their ids. What
/// changes while a stepper runs (motions, accelerations, holds, asleep) is changed by Trajectories
/// alone. Internal to native/.
struct Bodies {
  Vec3 gravity = Vec3::Zero();       ///< m/s^2
  std::vector<Motion> motions;       ///< by sphere
  std::vector<Vec3> accelerations;   ///< m/s^2, by sphere
  std::vector<Holds> holds;          ///< by sphere
  std::vector<std::uint8_t> asleep;  ///< by sphere: 1 if it is at rest and does not yield
  std::vector<double> radii;         ///< m, by sphere
  std::vector<BodyId> ids;           ///< by sphere, ascending
  std::vector<Wall> walls;   ///< steady planes, then planes that oscillate, then faces of boxes
  std::uint32_t steady = 0;  ///< number of walls before the first that oscillates
  std::uint32_t faces = 0;   ///< number of walls before the first face of a box
  std::vector<Solid> solids;
  double level = 0.0;     ///< m/s^2; a smaller component along a normal is rounding
  std::size_t apart = 0;  ///< number of spheres whose acceleration is not gravity

  std::size_t count() const { return motions.size(); }  ///< number of spheres
  bool isAsleep(std::size_t sphere) const { return asleep[sphere] != 0; }

  Motion at(std::size_t sphere, const Instant& instant) const {
    return motions[sphere].at(instant, accelerations[sphere]);
  }
  void setAcceleration(std::size_t sphere, const Vec3& acceleration) {
    if (accelerations[sphere] != gravity) --apart;
    accelerations[sphere] = acceleration;
    if (acceleration != gravity) ++apart;
  }

  /// Height in m of the lowest point of the sphere, if it were at `position`, above the wall at
  /// `instant`, without oscillation.
  double height(std::size_t sphere, const Wall& wall, const Vec3& position,
                const Instant& instant) const {
    const double height =
        dotInOrder(wall.plane.normal, position) - wall.plane.offset - radii[sphere];
    return wall.speed == 0.0 ? height : height - wall.speed * elapsed(Instant{}, instant);
  }
  /// Height in m like `height`, with the oscillation of the wall included.
  double clearance(std::size_t sphere, const Wall& wall, const Vec3& position,
                   const Instant& instant) const {
    const double smooth = height(sphere, wall, position, instant);
    if (!wall.oscillates()) return smooth;
    return smooth - wall.oscillation.amplitude * wall.oscillation.at(instant).sine;
  }
  BoxNearest nearest(const Solid& solid, const Vec3& position, const Instant& instant) const {
    return nearestOf(solid.box.halfExtents, along(solid.axes, position - solid.centreAt(instant)));
  }
  /// Path of a sphere in the frame of a box, from the beginning of its motion.
  BoxPath pathBy(const Solid& solid, const Motion& motion, const Vec3& acceleration) const {
    return {along(solid.axes, motion.position - solid.centreAt(motion.since)),
            along(solid.axes, motion.velocity - solid.box.velocity),
            {alongNormal(solid.axes[0], acceleration), alongNormal(solid.axes[1], acceleration),
             alongNormal(solid.axes[2], acceleration)}};
  }
  /// Component of the acceleration (m/s^2) along a normal; 0 if it is no more than rounding.
  double alongNormal(const Vec3& normal, const Vec3& acceleration) const {
    const double along = dotInOrder(normal, acceleration);
    return std::abs(along) > level ? along : 0.0;
  }
};

/// Returns the bodies of a world at time 0; `listed` holds, by sphere, its position in
/// `world.spheres`.
Bodies bodiesOf(const SphereWorld& world, std::span<const std::uint32_t> listed);

}  // namespace carom::native
