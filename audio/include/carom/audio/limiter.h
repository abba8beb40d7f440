#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <carom/audio/result.h>

namespace carom {

struct LimiterSettings {
  double sampleRate = 48000.0;  ///< Hz, above 0 up to 1e6
  std::size_t channels = 1;     ///< 1 to 1024, all turned down together
  float ceiling = 1.0F;         ///< of the samples' own unit, above 0: no output exceeds it
  /// s, 1e-4 to 0.02. The gain begins to fall this long before a peak: shorter is heard as
  /// distortion, longer as a swell. It is the delay, too.
  double lookAhead = 0.002;
  /// s, 1e-3 to 10: a gain that rises again has come 63 % of its way to 1 after this time.
  double release = 0.05;
};

/// A look-ahead peak limiter for the very end of the chain.
///
/// Model. Each frame asks for the gain that brings its loudest channel to the ceiling, or 1. The
/// least of these over the look-ahead window falls at once and rises exponentially (`release`);
/// this is smoothed by two running means whose lengths add up to the same window, so that the gain
/// has reached what a peak asks for by the time the peak leaves the delay line. One gain for all
/// channels, so that nothing moves between left and right.
///
/// Promises. Where the gain is 1, the output is the input, latency() frames later, bit for bit: so
/// it is in a signal that never exceeds the ceiling, and again some 17 `release` after a peak. (The
/// exponential is taken for 1 within 2^-24: a step of -144 dB.) No output sample exceeds the
/// ceiling. The output does not depend on the sizes of blocks by one bit: the means are sums of
/// whole numbers, which do not drift, and the same on every platform but for one std::exp at the
/// start. Gains are kept to 2^-36: a peak more than 216 dB above the ceiling becomes silence.
///
/// A sample that is not finite is bad input: it counts as 0, and is counted.
///
/// Not modelled: it bounds samples, not the true peak between them. What a converter reconstructs
/// may overshoot the ceiling: with limited clicks at 48 kHz by 0.01 dB where the contact lasts 1
/// ms, 0.1 dB at 200 us, 0.7 dB at 100 us and 1.3 dB at 50 us (measured, limiter_test.cpp).
/// Leave room with `ceiling` where that matters.
class Limiter {
 public:
  /// Refuses settings out of the ranges above. Allocates all that is ever needed. [any thread]
  static Result<Limiter> create(const LimiterSettings& settings);

  /// Limits `frames` samples of each channel in place; what comes out is what went in latency()
  /// frames ago, at first zeros. `channels` are as many as in the settings; asserted, and
  /// otherwise nothing happens. Never allocates. [audio thread]
  void process(std::span<float* const> channels, std::size_t frames) noexcept;

  /// As if just created, the counters too. Never allocates. [audio thread]
  void reset() noexcept;

  std::size_t latency() const { return delay_; }  ///< frames
  /// 1, the least gain that was applied so far: 1 where nothing has been limited.
  double leastGain() const { return leastGain_; }
  /// dB, the same: 20 log10(1 / leastGain), 0 where nothing has been limited; infinite for silence.
  double largestReduction() const;
  std::uint64_t notFinite() const { return notFinite_; }  ///< samples that counted as 0

 private:
  /// The sum of the last `length` values: their mean, without the division.
  class RunningSum {
   public:
    RunningSum(std::size_t length, std::uint64_t start);
    std::uint64_t push(std::uint64_t value) noexcept;
    void fill(std::uint64_t value) noexcept;
    std::size_t length() const { return values_.size(); }

   private:
    std::vector<std::uint64_t> values_;
    std::uint64_t sum_ = 0;
    std::size_t next_ = 0;
  };
  /// The least of the last `length` values; a queue of those that may still become the least.
  class RunningMinimum {
   public:
    explicit RunningMinimum(std::size_t length) : entries_(length) {}
    double push(double value) noexcept;
    void clear() noexcept;

   private:
    struct Entry {
      double value = 1.0;
      std::uint64_t frame = 0;
    };
    std::vector<Entry> entries_;  // a ring
    std::size_t first_ = 0;
    std::size_t count_ = 0;
    std::uint64_t frame_ = 0;
  };

  Limiter(const LimiterSettings& settings, std::size_t window);
  double wantedGain(std::span<float* const> channels, std::size_t frame) noexcept;
  double smoothGain(double wanted) noexcept;

  float ceiling_;
  std::size_t channels_;
  std::size_t delay_;    // frames
  double releaseShare_;  // of the way to 1, per frame
  double unity_;         // what the sums make of a gain of 1
  RunningMinimum minimum_;
  RunningSum early_;
  RunningSum late_;
  std::vector<float> line_;  // interleaved, `delay_` frames
  std::size_t place_ = 0;    // frame in line_
  double released_ = 1.0;
  double leastGain_ = 1.0;
  std::uint64_t notFinite_ = 0;
};

}  // namespace carom
