#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "plugin/realtime/spsc_queue.h"

namespace carom::plugin {

/// The gain of Level::automatic: what a camera's exposure is to light.
///
/// It follows a level in Pa, the loudest of late, which comes out as kTarget. Sounds raise it:
/// clicks and rings when they are scheduled, kAttack before they are heard, and everything when it
/// is rendered. kHold after the loudest it falls by kRelease for each second of the simulation; so
/// it keeps still while the simulation pauses. It never falls by more than kRange from the loudest
/// ever, nor below kLeastFullScale. Before the first sound it is what was predicted; the first one
/// sets it, but to no less than kPredicted of that.
///
/// Everything happens on whole blocks of kBlock samples of the renderer's clock: the result is the
/// same for all sizes of blocks that are asked for.
class Exposure {
 public:
  static constexpr double kTarget = 0.5;            ///< sample value of the level: -6 dB
  static constexpr double kAttack = 0.010;          ///< s
  static constexpr double kHold = 1.0;              ///< s of the simulation
  static constexpr double kRelease = 3.0;           ///< dB/s of the simulation
  static constexpr double kRange = 30.0;            ///< factor
  static constexpr double kPredicted = 0.125;       ///< factor
  static constexpr double kLeastFullScale = 0.02;   ///< Pa
  static constexpr double kUnpredicted = 2.0;       ///< Pa, full scale of what nobody predicts
  static constexpr std::size_t kBlock = 32;         ///< samples
  static constexpr std::size_t kMostMarks = 0x800;  ///< steps on their way

  explicit Exposure(double sampleRate);

  // [simulation thread]
  /// Predicts the peak (Pa) of the first blow. Of several predictions the loudest counts.
  void predict(double pressure) noexcept { announce({.sample = 0, .pressure = pressure}); }
  /// Says that a sound with a peak of `pressure` (Pa) begins at that sample.
  void expect(std::int64_t sample, double pressure) noexcept {
    announce({.sample = sample, .pressure = pressure, .isSound = true});
  }
  /// Says that the simulation moves from sample `begin` to sample `end`.
  void advance(std::int64_t begin, std::int64_t end) noexcept;

  /// Turns pascals that begin at sample `position` into samples, in place. [audio thread]
  void apply(std::span<float* const> channels, std::size_t frames, std::int64_t position) noexcept;

 private:
  struct Announcement {
    std::int64_t sample = 0;
    double pressure = 0.0;  // Pa
    bool isSound = false;   // else a prediction
  };
  struct Step {
    std::int64_t begin = 0;
    std::int64_t end = 0;
  };

  void announce(const Announcement& announcement) noexcept;
  void receive() noexcept;
  void beginBlock(std::int64_t position) noexcept;
  void takeAnnouncements(std::int64_t position) noexcept;
  bool isMoving(std::int64_t position) noexcept;
  void hear(double pressure) noexcept;
  void release() noexcept;

  SpscQueue<Announcement> announcements_{kMostMarks};
  SpscQueue<Step> steps_{kMostMarks};

  // The audio thread's members.
  /// Announcements that are not due: what is far away comes later than what is told after it.
  std::array<Announcement, 256> awaited_{};
  std::size_t awaitedCount_ = 0;
  std::int64_t attack_;      // samples
  double approach_;          // share of the way to its goal that the gain goes in a block, in dB
  double falling_;           // factor on the level in a block
  std::size_t holdBlocks_;   // blocks that the level is held
  std::size_t heldFor_ = 0;  // blocks since the level was raised
  bool hasHeard_ = false;
  double level_ = 0.0;    // Pa
  double loudest_ = 0.0;  // Pa, ever
  double block_ = 0.0;    // Pa, peak of the block under way
  double gain_ = 0.0;     // 1/Pa; 0 before the first block
  double slope_ = 0.0;    // of the gain, for each sample
};

}  // namespace carom::plugin
