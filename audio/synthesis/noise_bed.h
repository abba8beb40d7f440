#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "audio/model/third_octaves.h"

namespace carom::audio {

/// Noise in each third octave, of power 1: loops whose lengths have few common factors, so that
/// their sum does not repeat. Immutable, to be shared. [any thread]
class BandNoise {
 public:
  /// Makes the loops, or returns those that exist at that sample rate (Hz). Those that were asked
  /// for last stay (3 MB). Third octaves beyond the band (kBand) are silent.
  static std::shared_ptr<const BandNoise> at(double sampleRate);

  std::span<const float> loop(std::size_t band) const { return loops_[band]; }

 private:
  explicit BandNoise(double sampleRate);
  std::vector<std::vector<float>> loops_;
};

/// Powers of noise at all channels which a NoiseBed reaches at a moment.
struct NoiseLevel {
  std::int64_t at = 0;       ///< sample of the clock
  std::int64_t since = 0;    ///< sample from which on the powers approach these ones, linearly
  std::int64_t lasting = 0;  ///< samples, > 0, in which the noise fades if no other level follows
  /// Pa^2, by channel and third octave: kThirdOctaves for each channel. Empty: no level.
  std::span<const float> powers = {};
};

/// The sound of all the lasting contacts that have no voice of their own: noise on each
/// channel, shaped by the sum of their powers. What it costs does not depend on how many they are.
///
/// The bits of a sample depend on the levels alone, as long as each is added before the clock
/// reaches its `since`, and not on how the clock advances. Nothing allocates but the constructor
/// and, without a capacity, `add`. [one thread]
class NoiseBed {
 public:
  /// Levels that may wait; without a capacity any number may.
  NoiseBed(double sampleRate, std::size_t channels, std::optional<std::size_t> capacity);

  /// Adds a level, in place of those that have not begun before it. Returns false, and adds
  /// nothing, if too many wait.
  bool add(const NoiseLevel& level);
  /// The samples of channels, `stride` apart.
  struct Output {
    double* samples = nullptr;
    std::size_t stride = 0;
    std::size_t frames = 0;
    double* send = nullptr;  ///< if not null, the last channel, in place of its place in `samples`
  };
  /// Adds the samples from `position` on.
  void mix(std::int64_t position, const Output& to) noexcept;
  void clear();
  bool isSilent() const { return count_ == 0; }

 private:
  /// Samples over which amplitudes are linear.
  static constexpr std::int64_t kHop = 64;
  struct Point {
    std::int64_t at = 0;
    std::int64_t since = 0;
    std::int64_t lasting = 0;
  };
  const Point& point(std::size_t index) const;
  std::span<const float> powersOf(std::size_t index) const;
  void grow();
  void drop() noexcept;
  void forget(std::int64_t position) noexcept;
  void aim(std::int64_t position) noexcept;
  void mixHop(std::int64_t position, const Output& to) noexcept;

  std::size_t channels_;
  std::optional<std::size_t> capacity_;
  std::shared_ptr<const BandNoise> noise_;
  std::vector<Point> points_;   // a ring buffer
  std::vector<float> powers_;   // of points_
  std::vector<float> silence_;  // powers of no noise
  std::size_t oldest_ = 0;
  std::size_t count_ = 0;
  std::vector<float> before_;  // amplitudes at the begin of the hop in hand
  std::vector<float> after_;   // amplitudes at its end
  std::int64_t hop_ = 0;       // the hop of after_, in hops of the clock
  bool isAimed_ = false;
};

}  // namespace carom::audio
