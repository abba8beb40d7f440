#pragma once

#include <vector>

#include "lab/fit/tap_recording.h"

#include "carom/audio/result.h"
#include "carom/modal/analysis_settings.h"

namespace carom::lab {

/// The band in which modes of a recording are looked for, and what counts.
struct TapModeSettings {
  double lowest = 40.0;          ///< Hz
  double highest = 20000.0;      ///< Hz; at most 0.45 of the sampling rate is used
  double leastLevel = -70.0;     ///< dB below the strongest mode: quieter ones are left out
  double leastOverNoise = 12.0;  ///< dB, TapMode::overNoise
};

/// A mode that was found in recordings of taps.
struct TapMode {
  double frequency = 0.0;  ///< Hz, of the oscillation that is heard
  double decayRate = 0.0;  ///< 1/s, amplitude falls as exp(-decayRate t)
  double level = 0.0;      ///< dB at the onset, relative to the strongest mode of the tap
  /// dB, the energy of its ring over the noise's power in 1 Hz: how far its peak stands above the
  /// noise in a spectrum whose window fits it. A decay is sure to some 4 % at 30 dB.
  double overNoise = 0.0;
  double overAround = 0.0;  ///< dB, its peak above the median of the ring's own spectrum around it
  double confidence = 0.0;  ///< 0 to 1: above the noise, stable, found by both methods
  double frequencyError = 0.0;  ///< Hz, standard deviation by the noise alone (Cramer and Rao)
  double decayError = 0.0;      ///< 1/s, the same
  double stability = 0.0;       ///< share of other orders and windows that found it too
  bool bySubspace = false;      ///< found by the subspace method
  bool byPeak = false;          ///< found as a plain peak
  double peakDecayRate = 0.0;   ///< 1/s, by the slope of its band; 0: not measured
};

/// The modes and tones that were found in recordings of one object.
struct TapModes {
  std::vector<TapMode> modes;  ///< ascending in frequency
  std::vector<double> hum;     ///< Hz, steady tones that were there before the tap: left out
};

/// Finds the modes that one or more taps of one object have in common (other places of the blow,
/// other microphones): damped oscillations in bands of 200, 800 and 3200 Hz and windows of 1.5 s to
/// 30 ms by subspaceModes, which finds slow, medium and quick ones, beside the plain peaks of the
/// loudest tap. Close pairs are told apart where one window holds a third of their beat.
///
/// Errors: no taps; taps of different sampling rates; nothing rings; `progress` said false. [any
/// thread]
Result<TapModes> tapModes(const std::vector<TapSegment>& taps, const TapModeSettings& settings = {},
                          const Progress& progress = {});

}  // namespace carom::lab
