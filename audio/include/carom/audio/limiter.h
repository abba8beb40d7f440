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
  float ceiling = 1.0F;         ///< limit in the unit of the samples, above 0: no output exceeds it
  /// s, 1e-4 to 0.02. The gain begins to fall this long before a peak: shorter is heard as
  /// distortion, longer as a swell. It is the delay, too.
  double lookAhead = 0.002;
  /// s, 1e-3 to 10: a gain that rises again has come 63 % of its way to 1 after this time.
  double release = 0.05;
};

/// A look-ahead peak limiter for the very end of the chain.
///
/// Model. Each frame asks for the gain that brings its loudest channel to the ceiling, or for 1.
/// The least of these gains over the look-ahead window falls at once and rises exponentially
/// (`release`); this is smoothed by two running means whose lengths add up to the same window, so
/// that the gain has reached what a peak asks for by the time the peak leaves the delay line. All
/// channels have one gain, so that nothing moves between left and right.
///
/// Promises. Where the gain is 1, the output is the input, latency() frames later, bit for bit:
/// always in a signal that never exceeds the ceiling, and again some 17 `release` after a peak. (A
/// gain within 2^-24 of 1 counts as 1: a step of -144 dB.) No output sample exceeds the ceiling.
/// The output is the same bit for bit for all sizes of blocks, since the means are sums of whole
/// numbers, which do not drift, and on every platform but for one std::exp at the start. Gains are
/// kept to 2^-36: a peak more than 216 dB above the ceiling becomes silence.
///
/// A sample that is not finite is bad input: it is replaced by 0 and counted.
///
/// Not modelled: the true peak between samples, which is not bounded. The signal that a converter
/// reconstructs may overshoot the ceiling: with limited clicks at 48 kHz by 0.01 dB where the
/// contact lasts 1 ms, 0.1 dB at 200 us, 0.7 dB at 100 us and 1.3 dB at 50 us (measured,
/// limiter_test.cpp). Leave room with `ceiling` where that matters.
class Limiter {
 public:
  /// Refuses settings out of the ranges above. Allocates all the memory that it ever needs.
  /// [any thread]
  static Result<Limiter> create(const LimiterSettings& settings);

  /// Limits `frames` samples of each channel in place; the output is the input of latency() frames
  /// ago, at first zeros. Requires as many `channels` as the settings have (asserted; otherwise
  /// nothing happens). Never allocates. [audio thread]
  void process(std::span<float* const> channels, std::size_t frames) noexcept;

  /// Returns to the state after creation, counters included. Never allocates. [audio thread]
  void reset() noexcept;

  std::size_t latency() const { return delay_; }  ///< frames
  /// The least gain applied so far, dimensionless: 1 if nothing has been limited.
  double leastGain() const { return leastGain_; }
  /// The largest reduction so far in dB, 20 log10(1 / leastGain): 0 if nothing has been limited;
  /// infinite for silence.
  double largestReduction() const;
  std::uint64_t notFinite() const { return notFinite_; }  ///< samples that were replaced by 0

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
  /// The least of the last `length` values, as a queue of the values that may still become the
  /// least.
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
    std::vector<Entry> entries_;  // a ring buffer
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
  double releaseShare_;  // share of the way to 1 that the gain rises per frame
  double unity_;         // output of both sums for a gain of 1
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
