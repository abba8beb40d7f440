#pragma once

#include "carom/native/motion.h"

namespace carom::native {

inline constexpr double kWholeTurn = 6.28318530717958647692;  ///< rad

struct SineCosine {
  double sine = 0.0;
  double cosine = 1.0;
};

/// Returns sine and cosine of 2 pi `turns`, for finite `turns` below 2^50 in size. The reduction to
/// an eighth of a turn is exact, followed by Taylor's series: within 1e-15, with + - * / and floor
/// alone, so with the same bits everywhere. [any thread]
SineCosine sineOfTurns(double turns) noexcept;

/// A harmonic motion along a normal: amplitude sin(2 pi (frequency t + turns)).
struct NormalOscillation {
  double amplitude = 0.0;  ///< m, of either sign
  double frequency = 0.0;  ///< Hz, > 0
  double turns = 0.0;      ///< the phase, in turns

  /// Sine and cosine of the phase at `instant`. The product of frequency and time is taken to twice
  /// the precision of a double, so that the result is as exact after a day as at the start. [any
  /// thread]
  SineCosine at(const Instant& instant) const noexcept;
  double angularFrequency() const noexcept;  ///< rad/s
};

/// The motion of a point above the middle of an oscillating surface, positive along its normal: as
/// if the surface stood still there.
struct SmoothHeight {
  double height = 0.0;        ///< m
  double velocity = 0.0;      ///< m/s
  double acceleration = 0.0;  ///< m/s^2, constant
  double rounding = 0.0;      ///< m, possible error of a height
};

/// Returns the time in s from `start` until a point first meets an oscillating surface; kNever if
/// it never does, or if that is after `until` s.
///
/// There is no closed form; the method is conservative advancement (Mirtich 1996, PhD thesis,
/// section 2.3). While the parabola is out of the surface's reach, the step is the closed form of
/// its entry there. Within, the height above the surface has a second derivative of at least -M, M
/// = |amplitude| (2 pi frequency)^2 - acceleration: so the root s of h + h' s - M s^2 / 2 = 0 is a
/// step that cannot pass the contact. It has the value and the slope of the height, so near the
/// contact it is better than a Newton step, and converges quadratically. The search ends where the
/// height is below its rounding.
///
/// A point in touch at the start gets 0 if it approaches, or is at rest relative to the surface and
/// drawn in; otherwise it leaves first. [any thread]
double oscillatingContactTime(const SmoothHeight& smooth, const NormalOscillation& oscillation,
                              const Instant& start, double until) noexcept;

}  // namespace carom::native
