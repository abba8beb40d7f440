#pragma once

#include <cstdint>

namespace carom::audio {

/// Beyond this index a double, and so a time, skips whole samples: 5900 years at 48 kHz.
inline constexpr double kExactSamples = 0x1.0p+53;

/// Bounds of the factor by which motion or the clock may stretch a sound in time: beyond them a
/// click is that of bodies at rest, and a slide is silent.
inline constexpr double kLeastStretch = 0.1;
inline constexpr double kMostStretch = 10.0;

/// Delay on the sample clock against the simulation clock: whole + fraction samples, with fraction
/// from 0 to below 1.
struct SampleShift {
  std::int64_t whole = 0;  ///< does not change the bits of the samples
  double fraction = 0.0;
  double stretch = 1.0;  ///< durations on the sample clock over those on the simulation clock
};

/// A time in samples: whole + fraction, with fraction from 0 to below 1.
struct SampleTime {
  std::int64_t whole = 0;
  double fraction = 0.0;
};

/// Returns seconds + further (s) in samples, without loss: the rounding error of the product is
/// recovered and kept. Requires |seconds * sampleRate| < kExactSamples. [any thread]
SampleTime samplesOf(double seconds, double further, double sampleRate);

/// Returns the time on the sample clock. [any thread]
SampleTime shifted(SampleTime time, const SampleShift& shift);

}  // namespace carom::audio
