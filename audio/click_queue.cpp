#include "audio/click_queue.h"

#include <algorithm>

namespace carom {
namespace {

std::int64_t floorDivide(std::int64_t a, std::int64_t b) {
  return a / b - (a % b < 0 ? 1 : 0);
}

}  // namespace

std::size_t ClickQueue::dayOf(std::int64_t sample) {
  const std::int64_t day = floorDivide(sample, kSpan) % kDays;
  return static_cast<std::size_t>(day < 0 ? day + kDays : day);
}

void ClickQueue::push(const Entry& entry, std::int64_t now) {
  if (entry.slot >= nodes_.size()) {
    nodes_.resize(std::max<std::size_t>(entry.slot + 1, 2 * nodes_.size()));
    taken_.reserve(nodes_.size());
  }
  std::uint32_t& day = days_[dayOf(std::max(entry.first, now))];
  nodes_[entry.slot] = {entry, day};
  day = entry.slot;
  ++size_;
}

std::span<ClickQueue::Entry> ClickQueue::takeUntil(std::int64_t now, std::int64_t end) noexcept {
  taken_.clear();
  if (size_ == 0) return taken_;
  const std::int64_t first = floorDivide(now, kSpan);
  const std::int64_t last = std::min(floorDivide(end - 1, kSpan), first + kDays - 1);
  for (std::int64_t day = first; day <= last; ++day)
    takeFrom(days_[dayOf(day * kSpan)], end);
  size_ -= taken_.size();
  return taken_;
}

void ClickQueue::takeFrom(std::uint32_t& day, std::int64_t end) noexcept {
  std::uint32_t* link = &day;
  while (*link != kNone) {
    Node& node = nodes_[*link];
    if (node.entry.first < end) {
      taken_.push_back(node.entry);
      *link = node.next;
    } else {
      link = &node.next;
    }
  }
}

void ClickQueue::clear() {
  std::ranges::fill(days_, kNone);
  size_ = 0;
}

}  // namespace carom
