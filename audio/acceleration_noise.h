#pragma once

#include <cstdint>
#include <span>

#include "audio/impulse_event.h"
#include "audio/medium.h"
#include "audio/sound_body.h"

namespace carom {

// The click of a rigid sphere, as pure functions. All of this file: [any thread], no allocation.
//
//   p(t)  = rho0 a^3 cos(theta) / (2 c r) * V''(t - r/c)   Howe 2002, eq. 3.8.5 (the seed's eq. 1)
//   V''   = pi |j| / (2 m tau) * dS/dt                     Chadwick et al. 2012 (eq. 6 to 8)
//   S     = exp(-6 (u - 1/2)^2),  u = (t - t0) / tau       eq. 9 and its derivative, eq. 10
//
// Valid for wavelengths well above 2 pi a and distances above them (compact, far field).

/// The Gaussian is cut this many contact durations from its centre: there S is 5e-17, and what is
/// cut off is below the rounding of the pulse's own peak.
inline constexpr double kPulseHalfWidth = 2.5;

/// Beyond this index a double, and so a time, skips whole samples: 5900 years at 48 kHz.
inline constexpr double kExactSamples = 0x1.0p+53;

/// Largest magnitude of dS/du, at u = 1/2 -+ 1/sqrt(12): sqrt(12) exp(-1/2).
inline constexpr double kPulsePeakSlope = 2.101083837941101;

/// S(u) of eq. 9: the force of the contact over time, 1 at its centre u = 1/2.
double gaussianPulse(double u);

/// dS/du of eq. 10 with t in contact durations; dS/dt is this divided by tau.
double gaussianPulseSlope(double u);

/// rho0 a^3 cos(theta) / (2 c r) of eq. 1: Pa per m/s^3 of jerk. Positive towards the listener.
/// A listener nearer than the body's radius is heard as on its surface.
double compactRadiation(const Medium& medium, double bodyRadius, double distance, double cosine);

/// One event at one listener: p(t) = amplitude * dS/du at u = (t - time - delay) / duration.
struct Click {
  double time = 0.0;       ///< s, simulation clock: first touch, where the body is
  double delay = 0.0;      ///< s, r/c; kept apart from `time`, which may be large
  double duration = 0.0;   ///< s, > 0, tau
  double amplitude = 0.0;  ///< Pa, signed; positive where the body is pushed towards the listener

  double peak() const;              ///< Pa, >= 0, largest magnitude
  double pressure(double t) const;  ///< Pa, at simulation clock t (s); not cut off
};

/// The click of the share of `event` that `body` has, heard at `listener` (m, world frame), for a
/// contact that lasts `duration` s. `body` can move, and the event is finite.
Click makeClick(const ImpulseEvent& event, const SoundBody& body, double duration,
                const Vec3& listener, const Medium& medium);

/// A click laid over the samples of a clock. Whole and fraction of its centre are kept apart, so
/// that its shape is the same after a day as after a second.
struct SampledClick {
  std::int64_t first = 0;     ///< the samples [first, end) hold it
  std::int64_t end = 0;       ///< equal to `first` where it falls between two samples
  std::int64_t centre = 0;    ///< samples, whole part of the centre u = 1/2
  double fraction = 0.0;      ///< samples, [0, 1), the rest of it
  double duration = 0.0;      ///< samples, tau
  double amplitude = 0.0;     ///< Pa, as in Click
  std::uint32_t channel = 0;  ///< of the listener who hears it
};

/// Where the samples of `sampleRate` (Hz) fall on the click; sample 0 is simulation time 0.
SampledClick sampleClick(const Click& click, double sampleRate, std::uint32_t channel);

/// Whether the samples of the click can be counted exactly (below 2^53); otherwise it must not be
/// sampled.
bool canSample(const Click& click, double sampleRate);

/// Adds the click to `pressure` (Pa), whose first element is sample `position` of the clock. A
/// sample's bits depend on the click and its own index only, never on how a buffer is cut.
void addClick(const SampledClick& click, std::int64_t position,
              std::span<double> pressure) noexcept;

}  // namespace carom
