#include "bullet_bridge/tracking/pair_records.h"

#include <algorithm>

namespace carom::bullet {

PairRecord* PairRecords::find(std::uint64_t key) {
  const auto end = entries_.begin() + static_cast<std::ptrdiff_t>(known_);
  const auto found = std::lower_bound(entries_.begin(), end, Entry{key, 0});
  return found != end && found->first == key ? &records_[found->second] : nullptr;
}

PairRecord& PairRecords::add(std::uint64_t key) {
  if (free_.empty()) {
    free_.push_back(static_cast<std::uint32_t>(records_.size()));
    records_.emplace_back();
    records_.back().impact.landings.reserve(1);
  }
  const std::uint32_t place = free_.back();
  free_.pop_back();
  entries_.emplace_back(key, place);
  PairRecord& record = records_[place];
  record.open = record.spent = record.lasting = record.visited = false;
  record.idle = 0;
  return record;
}

void PairRecords::endSubstep() {
  std::erase_if(entries_, [this](const Entry& entry) {
    if (records_[entry.second].isNeeded()) return false;
    free_.push_back(entry.second);
    return true;
  });
  std::sort(entries_.begin(), entries_.end());
  known_ = entries_.size();
  for (const Entry& entry : entries_)
    records_[entry.second].visited = false;
}

}  // namespace carom::bullet
