#pragma once

#include <cstdint>
#include <vector>

#include "bullet_bridge/tracking/contact_pair.h"

namespace carom::bullet {

/// Remembers how far apart pairs were when that was last measured. As long as their bodies have not
/// gone as far since then, they have not met, whatever their shapes: near pairs that lie side by
/// side need not be measured in every substep. [physics thread]
///
/// Kept in a table in which a pair may displace another: it is then measured again.
class GapMemory {
 public:
  /// Must be called once per substep; `pairs` is the number of pairs that will be asked for.
  void beginSubstep(std::size_t pairs);
  /// Returns a lower bound (m) of the gap of a pair at the start of the substep; not positive if
  /// nothing is known.
  double leastGap(const ContactPair& pair) const;
  /// Remembers a lower bound (m) of the gap of a pair at the start of the substep.
  void remember(const ContactPair& pair, double gap);

  /// True for pairs that may be remembered: not for planes, which have no size, nor for meshes and
  /// terrain, whose host may move their corners.
  static bool canRemember(const ContactPair& pair);

 private:
  struct Entry {
    std::uint64_t key = 0;
    double travel = -1.0;  // m, sum of both bodies' TrackedBody::travel at which they might touch
    std::uint32_t shapes = 0;  // sum of both bodies' TrackedBody::shapeNumber
  };
  std::size_t placeOf(std::uint64_t key) const;

  std::vector<Entry> entries_;  // a power of two of them
};

}  // namespace carom::bullet
