#pragma once

#include <atomic>
#include <cstddef>
#include <span>

namespace carom::plugin {

/// A factor that another thread sets, and that is reached without a jump, along a straight line of
/// kRamp. At 1, samples keep their bits.
class OutputGain {
 public:
  static constexpr double kRamp = 0.02;  ///< s
  static constexpr float kMost = 1000.0F;

  explicit OutputGain(double sampleRate)
      : rampFrames_(static_cast<std::size_t>(kRamp * sampleRate)) {}

  /// Sets the factor, clamped to [0, kMost]; NaN is ignored. [any thread]
  void setGain(double gain) noexcept;
  void setMuted(bool muted) noexcept { muted_.store(muted, std::memory_order_relaxed); }

  /// Multiplies samples in place. [audio thread]
  void apply(std::span<float* const> channels, std::size_t frames) noexcept;

 private:
  void aim() noexcept;

  std::atomic<float> gain_{1.0F};
  std::atomic<bool> muted_{false};

  std::size_t rampFrames_;
  std::size_t framesLeft_ = 0;
  float goal_ = 1.0F;
  float now_ = 1.0F;
};

}  // namespace carom::plugin
