#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <span>

#include "audio/model/pulse.h"

namespace carom::audio {

/// Integral of a force of these nodes times exp(i w u), w in rad per contact duration.
std::complex<double> transformOf(std::span<const PulseNode> nodes, double w);

/// An upper bound of a pulse's spectrum, and so of how strongly the pulse excites a mode.
/// Immutable. [any thread]
class PulseSpectrum {
 public:
  /// Takes a millisecond or so; makes a rule of the pulse.
  explicit PulseSpectrum(const Pulse& pulse);

  /// Returns an upper bound of |integral of force(u) exp(i w u) du|, w >= 0 in rad per contact
  /// duration: a staircase that falls, and is constant from kHighest on.
  double bound(double w) const;

 private:
  static constexpr std::size_t kSteps = 64;
  static constexpr double kLowest = 0.3;     // rad per contact duration
  static constexpr double kHighest = 300.0;  // rad per contact duration

  double impulse_;
  std::array<double, kSteps> steps_{};  // bounds from kLowest on, in equal ratios of w
};

}  // namespace carom::audio
