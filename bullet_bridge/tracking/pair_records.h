#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "carom/audio/contact_state.h"
#include "carom/audio/impulse_event.h"

namespace carom::bullet {

/// The events of both bodies where they land, and the share of this landing in the impact.
struct Landing {
  ImpulseEvent body;   ///< the share of the pair's `body`
  ImpulseEvent other;  ///< the share of the pair's `other`
  double part = 1.0;   ///< fraction of the sum of all physical impulses of the impact
};

/// An impact that was found, and the impulse that Bullet has applied for it so far. It may have
/// several landings, in order of time: corners that reach the other surface one after the other,
/// but which Bullet solves together.
struct Impact {
  std::vector<Landing> landings;
  double restitution = 0.0;
  double foundAt = 0.0;         ///< s, start of the substep in which it was found
  Vec3 applied = Vec3::Zero();  ///< N s, on the pair's `body`
  int solved = 0;               ///< substeps in which Bullet's solver has acted
  bool parted = false;          ///< the bodies no longer approached after it
  bool delivered = false;
};

/// The state of a pair that the bridge keeps from one substep to the next.
struct PairRecord {
  BodyId body = 0;
  BodyId other = 0;
  bool open = false;     ///< an impact is under way: what Bullet applies belongs to it
  bool spent = false;    ///< delivered, or at rest, but still approaching: no new impact
  bool lasting = false;  ///< the pair is in lasting contact
  bool visited = false;  ///< has been resolved in this substep
  int idle = 0;          ///< substeps of the lasting contact without load, up to now
  Impact impact;
  ContactState state;  ///< contact state of the substep before

  bool isNeeded() const { return open || spent || lasting; }
};

/// The records of all pairs that need one, found by key. Memory is kept; a record stays where it is
/// until the end of the substep in which it is no longer needed.
class PairRecords {
 public:
  /// Returns nullptr if there is none. Records made in this substep are not found until its end.
  PairRecord* find(std::uint64_t key);
  /// Adds a record for a pair that has none; `impact` and `state` are as they were in some other
  /// use.
  PairRecord& add(std::uint64_t key);
  /// Removes records that are no longer needed. `forEach` follows the order of the keys.
  void endSubstep();

  template <class Visit>
  void forEach(Visit visit) {
    for (const Entry& entry : entries_)
      visit(records_[entry.second]);
  }

 private:
  using Entry = std::pair<std::uint64_t, std::uint32_t>;  // key and place

  std::vector<Entry> entries_;  // sorted by key up to known_, then this substep's
  std::size_t known_ = 0;
  std::vector<PairRecord> records_;
  std::vector<std::uint32_t> free_;  // places of records_ that are free
};

}  // namespace carom::bullet
