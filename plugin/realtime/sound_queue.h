#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "audio/synthesis/scheduled_sound.h"
#include "plugin/realtime/spsc_queue.h"

namespace carom::plugin {

/// Scheduled sounds on their way from the thread of the simulation to the audio thread, whole: one
/// queue of lines of the cache, in which each sound is a header, which says how many of what
/// follow, and its arrays. Wait-free on both sides; nothing allocates but the constructor.
class SoundQueue {
 public:
  /// The most that a sound can have, and how much of it may wait.
  struct Capacity {
    std::size_t clicks = 0;       ///< of one sound
    std::size_t excitations = 0;  ///< of one sound
    std::size_t modes = 0;        ///< of one excitation: higher ones do not cross
    std::size_t nodes = 0;        ///< of one sound
    std::size_t waitingClicks = 0;
    std::size_t waitingExcitations = 0;
    std::size_t waitingNodes = 0;
    bool hasEars = false;           ///< clicks come with directions
    std::size_t powers = 0;         ///< of a level of noise
    std::size_t waitingLevels = 0;  ///< of noise
  };
  explicit SoundQueue(const Capacity& capacity);

  // [simulation thread]
  /// Puts a sound behind those before; the audio thread does not see it before `publish`. Returns
  /// false and puts nothing if there is no room.
  bool put(const audio::ScheduledSound& sound) noexcept;
  void publish() noexcept { lines_.publish(); }
  /// Returns true if sounds that take so many lines together (linesOfClicks) can be put.
  bool hasRoom(std::size_t lines) noexcept { return lines_.writable(lines) >= lines; }
  /// Returns how many lines a sound takes that has no excitations.
  std::size_t linesOfClicks(std::size_t clicks, std::size_t nodes) const;
  /// Returns how many sounds of that many clicks, with so many nodes in all, can be put.
  std::size_t roomForClicks(std::size_t clicks, std::size_t nodes) noexcept;

  // [audio thread]
  /// Returns the oldest sound, or nullptr if there is none. It counts as taken; its arrays are
  /// valid until the next call.
  const audio::ScheduledSound* take() noexcept;

 private:
  static constexpr std::size_t kLineSize = 64;
  struct alignas(kLineSize) Line {
    std::array<std::byte, kLineSize> bytes;
  };
  /// The first line of each sound.
  struct Header {
    double peak = 0.0;
    std::uint32_t clicks = 0;
    std::uint32_t ears = 0;
    std::uint32_t excitations = 0;
    std::uint32_t taps = 0;
    std::uint32_t nodes = 0;
    std::uint32_t powers = 0;  // of a level of noise
    std::int64_t at = 0;       // NoiseLevel
    std::int64_t since = 0;    // NoiseLevel
    std::int64_t lasting = 0;  // NoiseLevel
    bool isEvent = false;
  };

  template <class T>
  static std::size_t linesOf(std::size_t count) {
    return (count * sizeof(T) + kLineSize - 1) / kLineSize;
  }
  static std::size_t linesOf(const Header& header);
  static std::size_t linesFor(const Capacity& capacity);
  std::size_t countOf(const audio::ScheduledSound& sound) const;
  template <class T>
  void putArray(const T* items, std::size_t count) noexcept;
  void putModes(const audio::ScheduledSound& sound, std::size_t count) noexcept;
  template <class T>
  void takeArray(std::vector<T>& items, std::size_t count) noexcept;

  SpscQueue<Line> lines_;
  Capacity capacity_;
  std::vector<double> compact_;  // taps of the modes that cross; of the simulation's thread

  // The sound that was taken last; of the audio thread.
  audio::ScheduledSound taken_;
  std::vector<audio::Click> clicks_;
  std::vector<audio::SphereWeights> ears_;
  std::vector<audio::ModalExcitation> excitations_;
  std::vector<double> taps_;
  std::vector<audio::PulseNode> nodes_;
  std::vector<float> powers_;
};

}  // namespace carom::plugin
