#include "native/scheduling/contact_queue.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace carom::native {
namespace {

constexpr double kLastDay = 0x1p62;           ///< number of the day that holds all later times
constexpr double kMostDaysPerSecond = 1e100;  ///< limit by which every time has a day
constexpr double kSpheresPerDay = 1.0;        ///< number of spheres due in a day that is aimed at
/// Least number of searches between two changes of the span of a day; the number of spheres, if
/// that is larger.
constexpr std::uint64_t kAdaptAfter = 512;
constexpr std::uint64_t kTolerable = 6;   ///< visits for each search that are cheap enough
constexpr std::int64_t kEmptyDays = 256;  ///< empty days in a row after which all spheres are read

}  // namespace

ContactQueue::ContactQueue(std::size_t spheres)
    : entries_(spheres), days_(std::bit_ceil(std::max<std::size_t>(spheres, 16)), kNobody) {}

std::int64_t ContactQueue::dayOf(const Instant& time) const {
  return static_cast<std::int64_t>(std::min(time.seconds * daysPerSecond_, kLastDay));
}

bool ContactQueue::earlier(std::uint32_t sphere, std::uint32_t other) const {
  const Instant& time = entries_[sphere].time;
  const Instant& otherTime = entries_[other].time;
  if (time.seconds != otherTime.seconds) return time.seconds < otherTime.seconds;
  if (time.rest != otherTime.rest) return time.rest < otherTime.rest;
  return sphere < other;
}

void ContactQueue::link(std::uint32_t sphere) {
  Entry& entry = entries_[sphere];
  if (!(entry.time < Instant::never())) return;
  const std::int64_t day = dayOf(entry.time);
  today_ = std::min(today_, day);
  std::uint32_t& first = days_[slotOf(day)];
  entry.next = first;
  entry.previous = kNobody;
  if (first != kNobody) entries_[first].previous = sphere;
  first = sphere;
  ++linked_;
}

void ContactQueue::unlink(std::uint32_t sphere) {
  const Entry& entry = entries_[sphere];
  if (!(entry.time < Instant::never())) return;
  if (entry.next != kNobody) entries_[entry.next].previous = entry.previous;
  if (entry.previous != kNobody) {
    entries_[entry.previous].next = entry.next;
  } else {
    days_[slotOf(dayOf(entry.time))] = entry.next;
  }
  --linked_;
}

void ContactQueue::setTime(std::uint32_t sphere, const Instant& time) {
  if (entries_[sphere].time == time) return;
  unlink(sphere);
  entries_[sphere].time = time;
  link(sphere);
  if (sphere == earliest_) {
    earliest_ = kNobody;
  } else if (earliest_ != kNobody && earlier(sphere, earliest_)) {
    earliest_ = sphere;
  }
}

void ContactQueue::findEarliest() {
  if (linked_ == 0) return;
  ++found_;
  if (visited_ > kTolerable * (found_ + entries_.size()) ||
      found_ > std::max<std::uint64_t>(kAdaptAfter, entries_.size())) {
    adapt();
    return;
  }
  for (std::int64_t empty = 0; empty < kEmptyDays; ++empty, ++today_) {
    ++visited_;
    for (std::uint32_t sphere = days_[slotOf(today_)]; sphere != kNobody;
         sphere = entries_[sphere].next) {
      ++visited_;
      if (dayOf(entries_[sphere].time) != today_) continue;  // belongs to a later year
      if (earliest_ == kNobody || earlier(sphere, earliest_)) earliest_ = sphere;
    }
    if (earliest_ != kNobody) return;
  }
  jump();
}

/// Jumps to the next day that is not empty, however far, by looking at all spheres.
void ContactQueue::jump() {
  visited_ += entries_.size();
  for (std::uint32_t sphere = 0; sphere < entries_.size(); ++sphere) {
    if (earliest_ == kNobody || earlier(sphere, earliest_)) earliest_ = sphere;
  }
  today_ = dayOf(entries_[earliest_].time);
}

/// Changes the span so that about one sphere comes due in each, unless the recent searches were
/// cheap enough.
void ContactQueue::adapt() {
  jump();
  const Instant now = entries_[earliest_].time;
  const double passed = elapsed(since_, now);
  if (visited_ > kTolerable * found_ && passed > 0.0)
    rebuild(std::min(static_cast<double>(found_) / (kSpheresPerDay * passed), kMostDaysPerSecond));
  since_ = now;
  found_ = 0;
  visited_ = 0;
}

void ContactQueue::rebuild(double daysPerSecond) {
  std::ranges::fill(days_, kNobody);
  daysPerSecond_ = daysPerSecond;
  linked_ = 0;
  today_ = static_cast<std::int64_t>(kLastDay);
  for (std::uint32_t sphere = 0; sphere < entries_.size(); ++sphere)
    link(sphere);
}

bool ContactQueue::valid() const {
  std::size_t linked = 0;
  for (std::uint32_t sphere = 0; sphere < entries_.size(); ++sphere) {
    const Entry& entry = entries_[sphere];
    if (!(entry.time < Instant::never())) continue;
    ++linked;
    const std::int64_t day = dayOf(entry.time);
    if (day < today_) return false;
    if (earliest_ != kNobody && earlier(sphere, earliest_)) return false;
    std::uint32_t at = days_[slotOf(day)];
    while (at != kNobody && at != sphere)
      at = entries_[at].next;
    if (at != sphere) return false;
  }
  return linked == linked_;
}

}  // namespace carom::native
