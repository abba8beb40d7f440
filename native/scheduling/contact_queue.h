#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "carom/native/motion.h"

namespace carom::native {

/// The queue of the times at which spheres need attention: earliest first, the lower sphere first
/// at equal times. It is a calendar queue (Brown 1988, Commun. ACM 31, 1220): a list for each short
/// span of time (a day), the same lists again after a while. So a change costs the same for any
/// number of spheres, and touches little memory. The span follows the rate at which spheres come
/// due; the order does not depend on it.
///
/// Internal to native/. The constructor allocates, nothing else does.
class ContactQueue {
 public:
  static constexpr std::uint32_t kNobody = 0xFFFFFFFF;

  explicit ContactQueue(std::size_t spheres);  ///< all times are never

  /// The sphere with the earliest time; kNobody if all times are never.
  std::uint32_t earliest() {
    if (earliest_ == kNobody) findEarliest();
    return earliest_;
  }
  const Instant& time(std::uint32_t sphere) const { return entries_[sphere].time; }
  void setTime(std::uint32_t sphere, const Instant& time);

  /// True if each sphere is in the list of its time, and none is due before the earliest.
  bool valid() const;

 private:
  struct Entry {
    Instant time = Instant::never();
    std::uint32_t next = kNobody;
    std::uint32_t previous = kNobody;
  };

  std::int64_t dayOf(const Instant& time) const;
  std::size_t slotOf(std::int64_t day) const {
    return static_cast<std::size_t>(day) & (days_.size() - 1);
  }
  bool earlier(std::uint32_t sphere, std::uint32_t other) const;
  void link(std::uint32_t sphere);
  void unlink(std::uint32_t sphere);
  void findEarliest();
  void jump();
  void adapt();
  void rebuild(double daysPerSecond);

  std::vector<Entry> entries_;       ///< by sphere
  std::vector<std::uint32_t> days_;  ///< by slot: the first sphere of its list
  double daysPerSecond_ = 1000.0;
  std::int64_t today_ = 0;            ///< the day before which no sphere is due
  std::uint32_t earliest_ = kNobody;  ///< kNobody if not known
  std::size_t linked_ = 0;            ///< number of spheres whose time is not never

  // Statistics since the last change of the span:
  std::uint64_t found_ = 0;    ///< searches for the earliest sphere
  std::uint64_t visited_ = 0;  ///< entries and days visited by these searches
  Instant since_;
};

}  // namespace carom::native
