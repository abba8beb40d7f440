#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "native/instant.h"

namespace carom {

/// When each sphere needs attention next, earliest first: an indexed heap with exactly one entry
/// per sphere, which moves when its time changes. Equal times are in order of the spheres. Four
/// children to a node, so that a sink reads one cache line per level.
///
/// Internal to native/. Construction allocates, nothing else does.
class ContactQueue {
 public:
  explicit ContactQueue(std::size_t spheres);  ///< all at never

  bool empty() const { return spheres_.empty(); }
  std::uint32_t earliest() const { return spheres_.front(); }  ///< not when empty
  const Instant& time(std::uint32_t sphere) const { return times_[slotOf_[sphere]]; }
  const Instant& earliestTime() const { return times_.front(); }  ///< not when empty
  void setTime(std::uint32_t sphere, const Instant& time);

  /// Whether parents are not later than children and the index is the inverse of the heap.
  bool valid() const;

 private:
  static constexpr std::size_t kChildren = 4;

  struct Entry {
    Instant time;
    std::uint32_t sphere = 0;
  };

  static bool earlier(const Entry& left, const Entry& right) {
    return left.time < right.time || (left.time == right.time && left.sphere < right.sphere);
  }
  Entry entry(std::size_t slot) const { return {times_[slot], spheres_[slot]}; }
  void place(std::size_t slot, const Entry& entry);
  std::size_t rise(std::size_t slot, const Entry& entry);
  std::size_t sink(std::size_t slot, const Entry& entry);

  std::vector<Instant> times_;          ///< by slot
  std::vector<std::uint32_t> spheres_;  ///< by slot
  std::vector<std::uint32_t> slotOf_;   ///< by sphere
};

}  // namespace carom
