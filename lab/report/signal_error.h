#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace carom::lab {

/// The sound at a listener: channels of equal length, Pa.
using Signal = std::vector<std::vector<float>>;

/// Returns the square root of the energy of the difference over that of the reference, for the
/// first `frames` samples of all channels: 0 for equal signals, 1 for a silent one, NaN if the
/// reference is silent. Channels that are shorter are silent from there on. [any thread]
double waveformError(const Signal& signal, const Signal& reference, std::size_t frames);

/// The error of a signal that may be shifted in time as a whole: ears do not notice such a shift,
/// but one of half a period is all that the plain error sees.
struct AlignedError {
  double error = 0.0;  ///< as waveformError, at the best delay
  double delay = 0.0;  ///< s, of the signal behind the reference
};

/// Computes the error at the delay within +-kLongestDelay at which the two agree best, to a
/// fraction of a sample. Exact to about 1e-5. [any thread]
AlignedError alignedError(const Signal& signal, const Signal& reference, std::size_t frames,
                          double sampleRate);

inline constexpr double kLongestDelay = 5e-3;  ///< s

/// The energy of a signal in a third of an octave.
struct ThirdOctave {
  double frequency = 0.0;  ///< Hz, nominal middle: 1000 times a power of 10^(1/10) (IEC 61260-1)
  double energy = 0.0;     ///< Pa^2 s, over all channels
};

/// Returns the whole bands from 50 Hz to 0.4 of the sample rate. [any thread]
std::vector<ThirdOctave> thirdOctaves(const Signal& signal, double sampleRate);

struct BandDifference {
  double frequency = 0.0;   ///< Hz
  double difference = 0.0;  ///< dB, of the signal above the reference
};

/// Returns the differences in the bands that are not more than 60 dB below the reference's loudest,
/// limited to +-60 dB. [any thread]
std::vector<BandDifference> bandDifferences(std::span<const ThirdOctave> signal,
                                            std::span<const ThirdOctave> reference);

/// Returns the root mean square of the differences, dB; 0 if there are none. [any thread]
double rmsOf(std::span<const BandDifference> differences);

}  // namespace carom::lab
