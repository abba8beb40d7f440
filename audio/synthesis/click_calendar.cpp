#include "audio/synthesis/click_calendar.h"

#include <algorithm>

namespace carom::audio {
namespace {

std::int64_t floorDivide(std::int64_t a, std::int64_t b) {
  return a / b - (a % b < 0 ? 1 : 0);
}

}  // namespace

std::size_t ClickCalendar::dayOf(std::int64_t sample) {
  const std::int64_t day = floorDivide(sample, kSpan) % kDays;
  return static_cast<std::size_t>(day < 0 ? day + kDays : day);
}

void ClickCalendar::reserve(std::size_t slots) {
  if (slots <= nodes_.size()) return;
  taken_.reserve(slots);
  nodes_.resize(slots);  // last, as its size tells that there is room in both
}

void ClickCalendar::push(const Entry& entry, std::int64_t now) {
  if (entry.slot >= nodes_.size())
    reserve(std::max<std::size_t>(entry.slot + 1, 2 * nodes_.size()));
  const std::size_t day = dayOf(std::max(entry.first, now));
  const std::uint32_t next = days_[day];
  if (next != kNone) nodes_[next].before = entry.slot;
  nodes_[entry.slot] = {entry, next, kNone, static_cast<std::uint32_t>(day)};
  days_[day] = entry.slot;
  ++size_;
}

void ClickCalendar::remove(std::uint32_t slot) noexcept {
  unlink(nodes_[slot]);
  --size_;
}

void ClickCalendar::unlink(const Node& node) noexcept {
  (node.before == kNone ? days_[node.day] : nodes_[node.before].next) = node.next;
  if (node.next != kNone) nodes_[node.next].before = node.before;
}

std::span<ClickCalendar::Entry> ClickCalendar::takeUntil(std::int64_t now,
                                                         std::int64_t end) noexcept {
  taken_.clear();
  if (size_ == 0) return taken_;
  const std::int64_t first = floorDivide(now, kSpan);
  const std::int64_t last = std::min(floorDivide(end - 1, kSpan), first + kDays - 1);
  for (std::int64_t day = first; day <= last; ++day)
    takeFrom(dayOf(day * kSpan), end);
  size_ -= taken_.size();
  return taken_;
}

void ClickCalendar::takeFrom(std::size_t day, std::int64_t end) noexcept {
  for (std::uint32_t slot = days_[day]; slot != kNone;) {
    const Node& node = nodes_[slot];
    slot = node.next;
    if (node.entry.first >= end) continue;
    taken_.push_back(node.entry);
    unlink(node);
  }
}

void ClickCalendar::clear() {
  std::ranges::fill(days_, kNone);
  size_ = 0;
}

}  // namespace carom::audio
