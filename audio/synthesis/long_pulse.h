#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "audio/model/pulse.h"

namespace carom::audio {

struct ClickKernels;
struct ClickTrack;

// Sampling of contacts that last many samples. Their force is evaluated at every half sample. The
// part of its spectrum beyond one and a half sample rates folds back into the band; in a pulse of
// many samples that part is due to its edges alone, where it is not smooth, and is known in advance
// from how it begins there (Lyness 1971, "The calculation of Fourier coefficients by the Moebius
// inversion of the Poisson summation formula", part I, Math. Comp. 25). A few values around each
// edge cancel it. [one thread] Nothing allocates but `reserve`.

/// Shares of an impulse at whole and half samples, to be spread by spreadKernel.
class Raster {
 public:
  static constexpr std::size_t kRows = 2;
  /// Number of zeros in front of each row and behind it.
  static constexpr std::size_t kPad = 48;

  void reserve(std::size_t samples);
  /// Sets all to zero, for so many samples.
  void clear(std::size_t samples);

  /// Row m, whose element [n] is at the time n + m / 2.
  double* row(std::size_t m) { return values_.data() + m * stride_ + kPad; }
  const double* row(std::size_t m) const { return values_.data() + m * stride_ + kPad; }

 private:
  std::vector<double> values_;
  std::size_t stride_ = 0;
};

/// Fills x with the samples of a contact of at least ten samples; x[0] is the track's time 0.
/// Shorter contacts are better sampled by a rule of the pulse.
void spreadLongPulse(const Pulse& pulse, const ClickTrack& track, const ClickKernels& kernels,
                     Raster& raster, std::span<double> x);

/// Correction for t^exponent from an edge on, on a raster of step 1 whose first point behind the
/// edge is `phase` behind it, 0 to 1: the values to add at kPoints points, the first kBefore of
/// them before that one, so that the sum over the raster becomes the integral, at all frequencies
/// in the band.
struct EdgeCorrection {
  static constexpr std::size_t kPoints = 6;
  static constexpr std::size_t kBefore = 2;  ///< points before the first one behind the edge
  std::array<double, kPoints> add{};
};
EdgeCorrection edgeCorrection(EdgeKind kind, double phase);

}  // namespace carom::audio
