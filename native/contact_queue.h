#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "carom/native/motion.h"

namespace carom::native {

/// When each sphere needs attention next, earliest first, and of equal times the lower sphere. A
/// calendar queue (Brown 1988, Commun. ACM 31, 1220): a list for each short span of time, the same
/// lists again after a while. So a change costs the same for any number of spheres, and touches
/// little memory. The span follows the rate at which spheres come due; the order does not depend on
/// it.
///
/// Internal to native/. Construction allocates, nothing else does.
class ContactQueue {
 public:
  static constexpr std::uint32_t kNobody = 0xFFFFFFFF;

  explicit ContactQueue(std::size_t spheres);  ///< all at never

  /// Whose time is the earliest; kNobody if all are at never.
  std::uint32_t earliest() {
    if (earliest_ == kNobody) findEarliest();
    return earliest_;
  }
  const Instant& time(std::uint32_t sphere) const { return entries_[sphere].time; }
  void setTime(std::uint32_t sphere, const Instant& time);

  /// Whether each sphere is in the list of its time, and none is due before the earliest.
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
  std::vector<std::uint32_t> days_;  ///< by slot: the first of its list
  double daysPerSecond_ = 1000.0;
  std::int64_t today_ = 0;            ///< nothing is due before
  std::uint32_t earliest_ = kNobody;  ///< kNobody: not known
  std::size_t linked_ = 0;            ///< spheres that are not at never

  // Since the last change of the span:
  std::uint64_t found_ = 0;    ///< earliest ones
  std::uint64_t visited_ = 0;  ///< entries and days that were looked at for them
  Instant since_;
};

}  // namespace carom::native
