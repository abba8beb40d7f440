#pragma once

#include <array>
#include <cstddef>

#include "audio/pulse.h"

namespace carom::audio {

/// An upper bound of a pulse's spectrum: what it leaves of a mode, at most. Immutable.
/// [any thread]
class PulseSpectrum {
 public:
  /// A millisecond or so; makes a rule of the pulse.
  explicit PulseSpectrum(const Pulse& pulse);

  /// Not below |integral of force(u) exp(i w u) du|, w >= 0 in rad per contact duration: a
  /// staircase that falls, and stands still from kHighest on.
  double bound(double w) const;

 private:
  static constexpr std::size_t kSteps = 64;
  static constexpr double kLowest = 0.3;     // rad per contact duration
  static constexpr double kHighest = 300.0;  // likewise

  double impulse_;
  std::array<double, kSteps> steps_{};  // from kLowest on, in equal ratios
};

}  // namespace carom::audio
