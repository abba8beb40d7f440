#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "audio/impulse_event.h"
#include "native/instant.h"

namespace carom {

/// The next contact time of every sphere, earliest first: an indexed binary heap with exactly one
/// entry per sphere, which moves when its time changes. Equal times are ordered by body id.
/// Internal to native/. Construction allocates, nothing else does.
class ContactQueue {
 public:
  /// One entry per id, at never. Sphere k below is the k-th id.
  explicit ContactQueue(const std::vector<BodyId>& ids);

  bool empty() const { return slots_.empty(); }
  std::size_t earliest() const { return slots_.front().sphere; }  ///< a sphere; not when empty
  const Instant& time(std::size_t sphere) const { return slots_[slotOf_[sphere]].time; }
  void setTime(std::size_t sphere, const Instant& time);

  /// Whether parents are not later than children and the index is the inverse of the heap.
  bool valid() const;

 private:
  struct Slot {
    Instant time;
    std::uint32_t sphere = 0;
    BodyId id = 0;
  };

  static bool earlier(const Slot& left, const Slot& right);
  void place(std::size_t position, const Slot& slot);
  std::size_t rise(std::size_t position, const Slot& slot);
  std::size_t sink(std::size_t position, const Slot& slot);

  std::vector<Slot> slots_;
  std::vector<std::size_t> slotOf_;  ///< by sphere
};

}  // namespace carom
