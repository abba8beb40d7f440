#pragma once

#include <algorithm>
#include <atomic>
#include <bit>
#include <cassert>
#include <cstddef>
#include <span>
#include <vector>

namespace carom::plugin {

/// A ring between one thread that writes and one that reads: where the simulation and the audio
/// thread meet. Wait-free on both sides, without allocation: every call takes a bounded number of
/// steps whatever the other thread does. Items that are published together are seen together.
///
/// After Lamport (1983, "Specifying concurrent program modules", ACM TOPLAS 5, 190-222): each side
/// owns one index and reads the other's; here with release and acquire, and with a copy of the
/// other's index that is refreshed only when it seems to say that nothing can be done.
template <class T>
class SpscQueue {
 public:
  /// Makes a queue that holds at least `capacity` items: the next power of two.
  explicit SpscQueue(std::size_t capacity) : items_(std::bit_ceil(capacity)) {}

  std::size_t capacity() const { return items_.size(); }

  /// Returns how many items can be written now, at least. [writing thread]
  std::size_t writable(std::size_t wanted) noexcept {
    const std::size_t free = items_.size() - (write_.index - write_.others);
    if (free >= wanted) return free;
    write_.others = read_.published.load(std::memory_order_acquire);
    return items_.size() - (write_.index - write_.others);
  }

  /// Puts an item behind what was put there before; the reader does not see it before `publish`.
  /// Requires that `writable` has told of room for it. [writing thread]
  void put(const T& item) noexcept {
    assert(write_.index - write_.others < items_.size());
    items_[write_.index++ & (items_.size() - 1)] = item;
  }
  /// Lets the reader see all items that were put, at once. [writing thread]
  void publish() noexcept { write_.published.store(write_.index, std::memory_order_release); }

  /// Returns how many items can be read now, at least. [reading thread]
  std::size_t readable(std::size_t wanted) noexcept {
    const std::size_t there = read_.others - read_.index;
    if (there >= wanted) return there;
    read_.others = write_.published.load(std::memory_order_acquire);
    return read_.others - read_.index;
  }
  /// Returns the item `ahead` places behind the oldest one. Requires that `readable` has told of
  /// it. [reading thread]
  const T& peek(std::size_t ahead = 0) const noexcept {
    assert(ahead < read_.others - read_.index);
    return items_[(read_.index + ahead) & (items_.size() - 1)];
  }
  /// Gives the oldest `count` items back. [reading thread]
  void drop(std::size_t count) noexcept {
    read_.index += count;
    read_.published.store(read_.index, std::memory_order_release);
  }

 private:
  /// One thread's end, on a line of the cache of its own.
  struct alignas(64) End {
    std::atomic<std::size_t> published{0};  // the index, for the other thread
    std::size_t index = 0;                  // counts all items ever
    std::size_t others = 0;                 // the other thread's, as last seen
  };
  static_assert(std::atomic<std::size_t>::is_always_lock_free);

  std::vector<T> items_;
  End write_;
  End read_;
};

}  // namespace carom::plugin
