#include "native/contact_queue.h"

#include <algorithm>
#include <numeric>

namespace carom {

ContactQueue::ContactQueue(std::size_t spheres)
    : times_(spheres, Instant::never()), spheres_(spheres), slotOf_(spheres) {
  std::iota(spheres_.begin(), spheres_.end(), 0U);  // in order is a heap
  std::iota(slotOf_.begin(), slotOf_.end(), 0U);
}

void ContactQueue::place(std::size_t slot, const Entry& entry) {
  times_[slot] = entry.time;
  spheres_[slot] = entry.sphere;
  slotOf_[entry.sphere] = static_cast<std::uint32_t>(slot);
}

std::size_t ContactQueue::rise(std::size_t slot, const Entry& entry) {
  while (slot > 0) {
    const std::size_t parent = (slot - 1) / kChildren;
    const Entry above = this->entry(parent);
    if (!earlier(entry, above)) break;
    place(slot, above);
    slot = parent;
  }
  return slot;
}

std::size_t ContactQueue::sink(std::size_t slot, const Entry& entry) {
  for (;;) {
    const std::size_t first = kChildren * slot + 1;
    if (first >= times_.size()) return slot;
    const std::size_t end = std::min(first + kChildren, times_.size());
    std::size_t soonest = first;
    Entry below = this->entry(first);
    for (std::size_t child = first + 1; child < end; ++child) {
      const Entry candidate = this->entry(child);
      if (!earlier(candidate, below)) continue;
      soonest = child;
      below = candidate;
    }
    if (!earlier(below, entry)) return slot;
    place(slot, below);
    slot = soonest;
  }
}

void ContactQueue::setTime(std::uint32_t sphere, const Instant& time) {
  const std::size_t slot = slotOf_[sphere];
  const Entry entry{time, sphere};
  if (time < times_[slot]) {
    place(rise(slot, entry), entry);
  } else {
    place(sink(slot, entry), entry);
  }
}

bool ContactQueue::valid() const {
  for (std::size_t slot = 0; slot < times_.size(); ++slot) {
    if (slotOf_[spheres_[slot]] != slot) return false;
    if (slot > 0 && earlier(entry(slot), entry((slot - 1) / kChildren))) return false;
  }
  return true;
}

}  // namespace carom
