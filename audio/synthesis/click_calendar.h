#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace carom::audio {

/// A queue of entries that wait for their sample: a calendar of lists, one for every kSpan samples,
/// which are used again after kDays of them. Nothing allocates but `push`. [one thread]
class ClickCalendar {
 public:
  static constexpr std::int64_t kSpan = 256;  // samples
  static constexpr std::int64_t kDays = 1024;

  struct Entry {
    std::int64_t first = 0;  ///< sample at which it begins
    double start = 0.0;      ///< samples after `first`: for the caller's order
    std::uint32_t slot = 0;  ///< the caller's small index, unique among the entries that wait
  };

  ClickCalendar() : days_(kDays, kNone) {}

  /// Adds an entry. `now` is the next sample that will be taken: a late entry waits for that one.
  void push(const Entry& entry, std::int64_t now);

  /// Makes room, so that no `push` of a slot below `slots` allocates.
  void reserve(std::size_t slots);
  /// Removes an entry that waits.
  void remove(std::uint32_t slot) noexcept;

  /// Removes and returns the entries that begin before `end`, in no order. `now` is the `end` of
  /// the call before. Valid until the next call.
  std::span<Entry> takeUntil(std::int64_t now, std::int64_t end) noexcept;

  std::size_t size() const { return size_; }
  void clear();

 private:
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  struct Node {
    Entry entry;
    std::uint32_t next = kNone;
    std::uint32_t before = kNone;  // kNone: it is the first of its day
    std::uint32_t day = kNone;     // index into days_
  };
  static std::size_t dayOf(std::int64_t sample);
  void takeFrom(std::size_t day, std::int64_t end) noexcept;
  void unlink(const Node& node) noexcept;

  std::vector<std::uint32_t> days_;  // the first slot of each list
  std::vector<Node> nodes_;          // by slot
  std::vector<Entry> taken_;
  std::size_t size_ = 0;
};

}  // namespace carom::audio
