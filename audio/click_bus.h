#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "audio/click_kernels.h"
#include "audio/radiation_filter.h"
#include "carom/audio/absorption.h"

namespace carom::audio {

/// What all clicks of a bus pass: of one radius, over one path, at one receiver.
struct BusChain {
  const RadiationFilter* radiation = nullptr;          ///< null: what is put in is pressure already
  std::span<const ReflectionFilter> reflections = {};  ///< of the walls on the path, in a row
};

/// Collects clicks before their filters, which are linear and so need to run only once for all of
/// them. Its samples count as those of the clock do; a click for radiation is put in
/// RadiationFilter::kFirstTap samples away from where it is heard.
///
/// A sample's bits depend on what was put in and not on how the clock advances. Nothing allocates
/// but `reserve`; [one thread].
class ClickBus {
 public:
  /// Samples before the clock that can still be put in, and are heard in part.
  static constexpr std::size_t kHistory = RadiationFilter::kTaps - 1;

  explicit ClickBus(const ClickKernels& kernels) : kernels_(&kernels) {}

  /// Silent, at `position` of the clock.
  void restart(const BusChain& chain, std::int64_t position);
  /// Makes room for what begins within `frames` samples from the clock on and has up to `samples`.
  void reserve(std::size_t frames, std::size_t samples);

  /// Adds far * x to what passes the filter's far part, near * x to its near part. What lies before
  /// the history is dropped.
  void add(std::int64_t first, std::span<const double> x, double far, double near) noexcept;

  /// Adds the next samples of pressure to `to`, and advances the clock. At most kMaxFrames.
  void advance(std::span<double> to) noexcept;
  static constexpr std::size_t kMaxFrames = 256;

  /// Nothing in it, nothing to come: advancing it adds zeros.
  bool isSilent() const { return held_ == 0 && !ringing_; }

 private:
  void drive(std::size_t from, std::span<double> pressure) const noexcept;
  void shift(std::size_t frames) noexcept;
  void ring(std::span<double> pressure) noexcept;

  const ClickKernels* kernels_;
  BusChain chain_;
  std::int64_t position_ = 0;
  std::vector<double> far_;   // kHistory samples before the clock, and those after it
  std::vector<double> near_;  // likewise
  std::size_t begin_ = 0;     // of both, the samples [begin_, held_) may not be zero
  std::size_t held_ = 0;
  bool hasNear_ = false;  // near_ was ever used
  bool ringing_ = false;  // a recursion holds something
  double last_ = 0.0;     // of the radiation's recursion
  double beforeLast_ = 0.0;
  std::vector<double> reflected_;  // one state per reflection
};

}  // namespace carom::audio
