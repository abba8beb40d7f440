#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "audio/radiation/radiation_filter.h"
#include "audio/synthesis/click_kernels.h"
#include "carom/audio/absorption.h"

namespace carom::audio {

/// The filters that all clicks of a bus pass: for one radius, one path and one receiver.
struct BusChain {
  const RadiationFilter* radiation = nullptr;          ///< null: the input is pressure already
  std::span<const ReflectionFilter> reflections = {};  ///< filters of the path's walls, in series
};

/// Sums clicks before their filters, which are linear and so need to run only once for all of them.
/// The bus counts samples as the clock does; a click for radiation is added
/// RadiationFilter::kFirstTap samples away from where it is heard.
///
/// The bits of a sample depend on the clicks that were added and not on how the clock advances.
/// Nothing allocates but `reserve`; [one thread].
class ClickBus {
 public:
  /// Number of samples before the clock at which a click can still be added; it is then heard in
  /// part.
  static constexpr std::size_t kHistory = RadiationFilter::kTaps - 1;

  explicit ClickBus(const ClickKernels& kernels) : kernels_(&kernels) {}

  /// Silences the bus and starts it with these filters at `position` of the clock.
  void restart(const BusChain& chain, std::int64_t position);
  /// Makes room for clicks of up to `samples` that begin within `frames` samples from the clock on.
  void reserve(std::size_t frames, std::size_t samples);

  /// Adds far * x to the input of the filter's far part, near * x to that of its near part, from
  /// the sample `first` on. Samples before the history are dropped.
  void add(std::int64_t first, std::span<const double> x, double far, double near) noexcept;

  /// Adds the next samples of pressure to `to`, and advances the clock. At most kMaxFrames.
  void advance(std::span<double> to) noexcept;
  static constexpr std::size_t kMaxFrames = 256;

  /// Sets to 0 what is not finite, or beyond `most` (Pa), in inputs and filters.
  void forgetAbove(double most) noexcept;

  /// True if the bus holds nothing and its filters have decayed: advancing it adds zeros.
  bool isSilent() const { return held_ == 0 && !ringing_; }

 private:
  void drive(std::size_t from, std::span<double> pressure) const noexcept;
  void shift(std::size_t frames) noexcept;
  void ring(std::span<double> pressure) noexcept;

  const ClickKernels* kernels_;
  BusChain chain_;
  std::int64_t position_ = 0;
  // Inputs of the filter's far and near part: kHistory samples before the clock, and those after
  // it.
  std::vector<double> far_;
  std::vector<double> near_;
  std::size_t begin_ = 0;  // only [begin_, held_) of both may differ from zero
  std::size_t held_ = 0;
  bool hasNear_ = false;           // near_ was ever used
  bool ringing_ = false;           // a recursion holds something
  double last_ = 0.0;              // previous output of the radiation's recursion
  double beforeLast_ = 0.0;        // the output before that
  std::vector<double> reflected_;  // one state per reflection
};

}  // namespace carom::audio
