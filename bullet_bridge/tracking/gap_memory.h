#pragma once

#include <cstdint>
#include <vector>

#include "bullet_bridge/shapes/shape_pair.h"
#include "bullet_bridge/tracking/contact_pair.h"

namespace carom::bullet {

/// Remembers how far apart pairs were when that was last measured, and in which direction. Until
/// their bodies have come that much nearer, or have turned that far, they have not met: near pairs
/// need not be measured in every substep. [physics thread]
///
/// Kept in a table in which a pair may displace another: it is then measured again.
class GapMemory {
 public:
  /// Must be called once per substep; `pairs` is the number of pairs that will be asked for.
  void beginSubstep(std::size_t pairs);
  /// Remembers the gap of a pair that was measured at the start of the substep, and a lower bound
  /// (m) of the gaps of pieces that were left out; does nothing if they overlap, or cannot be
  /// remembered: planes have no size, and the host may move the corners of meshes and terrain.
  void remember(const ContactPair& pair, const Proximity& start, double leftOut);

  /// Lower bounds of the gap (m) of a pair; not positive if nothing is known.
  struct Gap {
    double atStart = -1.0;  ///< at the start of the substep
    double least = -1.0;    ///< on the way
  };
  Gap of(const ContactPair& pair, double dt) const;
  /// Measures and remembers the gap along the direction in which it was measured last, or between
  /// the centres: a lower bound of it, at a fraction of what the gap itself costs. Returns nothing
  /// for pairs that cannot be remembered.
  Gap measureAlong(const ContactPair& pair, double dt);
  /// Returns the direction in which the gap of a pair was measured last, from the other body to the
  /// body; zero if it was in none.
  Vec3 directionOf(const ContactPair& pair) const;
  /// Measures the gap along that direction from the next substep on.
  void setDirection(const ContactPair& pair, const Vec3& direction);

 private:
  struct Entry {
    std::uint64_t key = 0;
    std::uint32_t shapes = 0;  // sum of both bodies' TrackedBody::shapeNumber
    bool isAlongNormal = false;
    double gap = 0.0;            // m
    double turned = 0.0;         // m, sum of both bodies' TrackedBody::turned
    Vec3 apart = Vec3::Zero();   // m, from the other body's centre to the body's
    Vec3 normal = Vec3::Zero();  // from the other body to the body
  };
  void rememberAlong(const ContactPair& pair, const Vec3& normal, double gap);
  std::size_t placeOf(std::uint64_t key) const;

  std::vector<Entry> entries_;  // a power of two of them
};

}  // namespace carom::bullet
