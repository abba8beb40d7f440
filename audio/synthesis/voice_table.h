#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace carom::audio {

/// A table of the events (voices) that wait for their sound to begin, with the quietest of them at
/// hand, and of the slots of their clicks. Nothing allocates but `reserve`. [one thread]
class VoiceTable {
 public:
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  void reserve(std::size_t voices, std::size_t slots);
  void clear() noexcept;

  std::size_t size() const { return used_; }
  bool isFull() const { return free_.empty(); }
  /// The quietest of the voices that have not begun, the latest among equals; kNone if all have
  /// begun.
  std::uint32_t quietest() const { return heap_.empty() ? kNone : heap_.front(); }
  double peak(std::uint32_t voice) const { return voices_[voice].peak; }

  /// True for the voice of an event, false for one of a lasting contact.
  bool isEvent(std::uint32_t voice) const { return voices_[voice].isEvent; }

  /// Adds a voice of that peak, in Pa. Requires !isFull().
  std::uint32_t add(double peak, bool isEvent = true) noexcept;
  /// Gives the voice one more click.
  void attach(std::uint32_t voice, std::uint32_t slot) noexcept;
  std::uint32_t voiceOf(std::uint32_t slot) const { return ofSlot_[slot].voice; }
  std::uint32_t firstSlot(std::uint32_t voice) const { return voices_[voice].slot; }
  std::uint32_t nextSlot(std::uint32_t slot) const { return ofSlot_[slot].next; }
  /// Removes a click; its voice goes with the last one.
  void detach(std::uint32_t slot) noexcept;

  bool hasBegun(std::uint32_t voice) const { return voices_[voice].heapPlace == kNone; }
  /// Marks a voice as begun: it is quietest() no more.
  void begin(std::uint32_t voice) noexcept;

  /// A value for the caller's use, 0 at first.
  double& mark(std::uint32_t voice) { return voices_[voice].mark; }

 private:
  struct Voice {
    double peak = 0.0;
    double mark = 0.0;
    std::uint64_t number = 0;
    std::uint32_t slot = kNone;  // slot of the first click
    std::uint32_t heapPlace = kNone;
    bool isEvent = false;
  };
  struct Slot {
    std::uint32_t voice = kNone;
    std::uint32_t next = kNone;
    std::uint32_t before = kNone;
  };
  bool isQuieter(std::uint32_t a, std::uint32_t b) const;
  void put(std::size_t place, std::uint32_t voice) noexcept;
  void rise(std::size_t place) noexcept;
  void sink(std::size_t place) noexcept;

  std::vector<Voice> voices_;
  std::vector<Slot> ofSlot_;
  std::vector<std::uint32_t> free_;
  std::vector<std::uint32_t> heap_;  // voices, the quietest first
  std::size_t used_ = 0;
  std::uint64_t number_ = 0;
};

}  // namespace carom::audio
