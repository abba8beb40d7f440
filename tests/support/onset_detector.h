#pragma once

#include <span>
#include <vector>

namespace carom::test {

struct OnsetSettings {
  /// Threshold over the loudest sample; quieter samples belong to no click (-100 dB). Below about
  /// 1e-7 the rounding of float samples begins to count as sound.
  double relativeThreshold = 1e-5;
  /// Threshold over the median magnitude of all samples, for recordings with a noise floor.
  double noiseFactor = 8.0;
  /// s; a click ends after this time below the threshold, and clicks that are nearer than this are
  /// one. It must exceed the quiet middle of the slowest click (0.6 tau when only its tips stand
  /// out).
  double gap = 0.25e-3;
};

struct Onset {
  double time = 0.0;  ///< s after the first sample
  double peak = 0.0;  ///< largest magnitude of the click, in the unit of the samples
};

/// Finds the clicks in a recording from its samples alone, without events or tau.
///
/// An onset is the time at which a click first reaches half of its largest magnitude, interpolated
/// between samples: the ringing ahead of a band-limited click is far below. For the Gaussian jerk
/// pulse that is at u = -0.0547 contact durations, early by 0.0547 tau (11 us of 200 us): half of
/// max v exp(-6 v^2), v = |u - 1/2|, is reached at v = 0.5547. The delay of the air is not
/// subtracted.
///
/// Limits: clicks are not found if they are more than 100 dB below the loudest, or nearer to the
/// one before than `gap` plus its audible length.
std::vector<Onset> findOnsets(std::span<const double> samples, double sampleRate,
                              const OnsetSettings& settings = {});

}  // namespace carom::test
