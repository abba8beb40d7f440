#include "native/contact_queue.h"

#include <algorithm>

namespace carom {

ContactQueue::ContactQueue(const std::vector<BodyId>& ids) : slotOf_(ids.size()) {
  slots_.reserve(ids.size());
  for (std::size_t sphere = 0; sphere < ids.size(); ++sphere) {
    slots_.push_back({Instant::never(), static_cast<std::uint32_t>(sphere), ids[sphere]});
  }
  std::sort(slots_.begin(), slots_.end(), earlier);  // a sorted array is a heap
  for (std::size_t position = 0; position < slots_.size(); ++position) {
    slotOf_[slots_[position].sphere] = position;
  }
}

bool ContactQueue::earlier(const Slot& left, const Slot& right) {
  if (left.time == right.time) return left.id < right.id;
  return left.time < right.time;
}

void ContactQueue::place(std::size_t position, const Slot& slot) {
  slots_[position] = slot;
  slotOf_[slot.sphere] = position;
}

std::size_t ContactQueue::rise(std::size_t position, const Slot& slot) {
  while (position > 0) {
    const std::size_t parent = (position - 1) / 2;
    if (!earlier(slot, slots_[parent])) break;
    place(position, slots_[parent]);
    position = parent;
  }
  return position;
}

std::size_t ContactQueue::sink(std::size_t position, const Slot& slot) {
  for (std::size_t child = 2 * position + 1; child < slots_.size(); child = 2 * position + 1) {
    if (child + 1 < slots_.size() && earlier(slots_[child + 1], slots_[child])) ++child;
    if (!earlier(slots_[child], slot)) break;
    place(position, slots_[child]);
    position = child;
  }
  return position;
}

void ContactQueue::setTime(std::size_t sphere, const Instant& time) {
  const std::size_t position = slotOf_[sphere];
  Slot slot = slots_[position];
  slot.time = time;
  const std::size_t risen = rise(position, slot);
  place(risen == position ? sink(position, slot) : risen, slot);
}

bool ContactQueue::valid() const {
  for (std::size_t position = 0; position < slots_.size(); ++position) {
    if (slotOf_[slots_[position].sphere] != position) return false;
    if (position > 0 && earlier(slots_[position], slots_[(position - 1) / 2])) return false;
  }
  return true;
}

}  // namespace carom
