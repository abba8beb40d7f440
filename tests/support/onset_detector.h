#pragma once

#include <span>
#include <vector>

namespace carom::test {

struct OnsetSettings {
  /// Of the loudest sample: what is quieter is not a click (-100 dB). Below about 1e-7 the rounding
  /// of float samples begins to count as sound.
  double relativeThreshold = 1e-5;
  /// Times the median magnitude of all samples, for recordings with a noise floor.
  double noiseFactor = 8.0;
  /// s: a click ends after so much time below the threshold. Must exceed the quiet middle of the
  /// slowest click (0.6 tau when only its tips stand out), and clicks nearer than this are one.
  double gap = 0.25e-3;
};

struct Onset {
  double time = 0.0;  ///< s after the first sample
  double peak = 0.0;  ///< largest magnitude of the click, in the unit of the samples
};

/// Finds the clicks in a recording, knowing nothing but its samples: no events, no tau.
///
/// An onset is the time at which a click first reaches half of its largest magnitude, interpolated
/// between samples: what rings ahead of a band-limited click is far below. For the Gaussian jerk
/// pulse that is at u = -0.0547 contact durations, so it is early by 0.0547 tau (11 us of 200 us):
/// half of max v exp(-6 v^2), v = |u - 1/2|, is reached at v = 0.5547. Delay of the air is not
/// taken off.
///
/// Floor: clicks more than 100 dB below the loudest, or nearer than `gap` plus their own audible
/// length to the one before, are not found.
std::vector<Onset> findOnsets(std::span<const double> samples, double sampleRate,
                              const OnsetSettings& settings = {});

}  // namespace carom::test
