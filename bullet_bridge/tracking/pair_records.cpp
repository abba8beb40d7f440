#include "bullet_bridge/tracking/pair_records.h"

#include <algorithm>
#include <cassert>

namespace carom::bullet {

void PairRecord::reuse(BodyId newBody, BodyId newOther) {
  body = newBody;
  other = newOther;
  resolvedIn = 0;
  idle = 0;
  state_ = PairState::separate;
}

bool PairRecord::isImpacting() const {
  return state_ == PairState::impacting || state_ == PairState::impactingInContact;
}

bool PairRecord::isSuppressed() const {
  return state_ == PairState::suppressed || state_ == PairState::suppressedInContact;
}

bool PairRecord::isInContact() const {
  return state_ == PairState::inContact || state_ == PairState::impactingInContact ||
         state_ == PairState::suppressedInContact;
}

template <std::size_t count>
void PairRecord::apply(const Transition (&transitions)[count]) {
  const Transition* const found = std::ranges::find(transitions, state_, &Transition::from);
  assert(found != std::end(transitions));
  if (found != std::end(transitions)) state_ = found->to;
}

void PairRecord::beginImpact() {
  apply({{PairState::separate, PairState::impacting},
         {PairState::inContact, PairState::impactingInContact}});
}

void PairRecord::endImpact() {
  apply({{PairState::impacting, PairState::separate},
         {PairState::impactingInContact, PairState::inContact}});
}

void PairRecord::suppressImpacts() {
  apply({{PairState::separate, PairState::suppressed},
         {PairState::inContact, PairState::suppressedInContact}});
}

void PairRecord::allowImpacts() {
  apply({{PairState::suppressed, PairState::separate},
         {PairState::suppressedInContact, PairState::inContact}});
}

void PairRecord::beginContact() {
  apply({{PairState::separate, PairState::inContact},
         {PairState::impacting, PairState::impactingInContact},
         {PairState::suppressed, PairState::suppressedInContact}});
}

void PairRecord::endContact() {
  apply({{PairState::inContact, PairState::separate},
         {PairState::impactingInContact, PairState::impacting},
         {PairState::suppressedInContact, PairState::suppressed}});
}

PairRecord* PairRecords::find(std::uint64_t key) {
  const auto end = entries_.begin() + static_cast<std::ptrdiff_t>(known_);
  const auto found = std::lower_bound(entries_.begin(), end, Entry{key, 0});
  return found != end && found->first == key ? &records_[found->second] : nullptr;
}

PairRecord& PairRecords::add(std::uint64_t key, BodyId body, BodyId other) {
  if (free_.empty()) {
    free_.push_back(static_cast<std::uint32_t>(records_.size()));
    records_.emplace_back();
    records_.back().impact.points.reserve(1);
  }
  const std::uint32_t place = free_.back();
  free_.pop_back();
  entries_.emplace_back(key, place);
  PairRecord& record = records_[place];
  record.reuse(body, other);
  return record;
}

void PairRecords::endSubstep() {
  std::erase_if(entries_, [this](const Entry& entry) {
    if (records_[entry.second].isNeeded()) return false;
    free_.push_back(entry.second);
    return true;
  });
  if (!std::is_sorted(entries_.begin(), entries_.end()))
    std::sort(entries_.begin(), entries_.end());
  known_ = entries_.size();
}

}  // namespace carom::bullet
