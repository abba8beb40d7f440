#pragma once

#include <span>
#include <vector>

#include "lab/fit/tap_recording.h"

namespace carom::lab {

/// A peak of a spectrum, and the decay of its band.
struct SpectralPeak {
  double frequency = 0.0;   ///< Hz
  double decayRate = 0.0;   ///< 1/s, of the amplitude; 0: the slope could not be measured
  double power = 0.0;       ///< of the spectrum at the peak
  double overAround = 0.0;  ///< dB, the peak above the median of the spectrum around
  double overNoise = 0.0;   ///< dB, the peak above the background
};

/// A one-sided power spectrum at equal steps from 0 Hz on.
struct PowerSpectrum {
  double step = 0.0;          ///< Hz
  std::vector<double> power;  ///< density, 1/Hz for full scale 1
};

/// Returns the spectrum of the first `window` samples (fewer if there are not so many) under the
/// falling half of a Hann window, zero-padded to the next power of 2 and once more.
PowerSpectrum ringSpectrum(std::span<const double> samples, std::size_t window, double sampleRate);

/// Finds the plain peaks of one tap, from `lowest` to `highest` Hz: local maxima 10 dB above the
/// background, by a long window and a short one; the frequency by a parabola through the three
/// highest points in dB, the decay by a straight line through the level of the peak's band over
/// time (less the background) until it meets the background. Beating pairs are one peak. Ascending
/// in frequency. [any thread]
std::vector<SpectralPeak> spectralPeaks(const TapSegment& tap, double lowest, double highest);

}  // namespace carom::lab
