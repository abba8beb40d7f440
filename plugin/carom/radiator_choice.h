#pragma once

#include <cstdint>
#include <string>

namespace carom {

/// How bodies that are not spheres push the air.
enum class RadiatorChoice : std::uint8_t {
  /// By the added mass of their shape, solved once for all bodies of equal shape (panelRadiator):
  /// a tenth of a second for a box, up to 0.3 s for a fine mesh, and up to 40 MB while it lasts.
  solved,
  /// As the sphere of their volume, equally in all directions: costs next to nothing. A plate is
  /// then far too quiet where it is hit flat, and too loud where it is hit on its edge.
  equivalentSphere,
};

/// What the choice came to.
struct RadiatorCounters {
  std::uint64_t solved = 0;  ///< shapes whose added mass is known; equal ones count once
  /// Of `solved`, within a step of the world, which it held up; see Sound::prepare.
  std::uint64_t solvedInStep = 0;
  /// Bodies so far that can move and whose surface is open, too complicated or no solid. They
  /// sound as the sphere of their volume; of half the box around them if they have none; and not
  /// at all if that has none either.
  std::uint64_t unsolved = 0;
  std::string unsolvedReason;  ///< of the latest of them; empty if there is none
  std::uint64_t links = 0;     ///< of multibodies, so far, that can move; see Sound
};

}  // namespace carom
