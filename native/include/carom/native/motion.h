#pragma once

#include <limits>

#include <carom/audio/vector.h>

namespace carom {

/// A point of simulation time to twice the precision of a double: seconds + rest, where `seconds`
/// is the sum rounded to nearest. After a day a double resolves 15 ps only, in which a ball at
/// 100 m/s moves by more than a nanometre; with the rest kept, the time between two contacts has
/// the same accuracy at any distance from the start.
///
/// Internal to native/; needs strict floating point (no fast-math).
struct Instant {
  double seconds = 0.0;
  double rest = 0.0;  ///< s, at most half a unit in the last place of `seconds`

  static constexpr Instant never() { return {std::numeric_limits<double>::infinity(), 0.0}; }

  friend bool operator==(const Instant&, const Instant&) = default;
};

inline bool operator<(const Instant& left, const Instant& right) {
  return left.seconds < right.seconds || (left.seconds == right.seconds && left.rest < right.rest);
}

/// Duration in s from `start` to `end`; infinite if `end` is never.
inline double elapsed(const Instant& start, const Instant& end) {
  return (end.seconds - start.seconds) + (end.rest - start.rest);
}

/// The instant `duration` s after `start`; an infinite duration gives never.
inline Instant after(const Instant& start, double duration) {
  if (duration == std::numeric_limits<double>::infinity()) return Instant::never();
  const double sum = start.seconds + duration;  // Knuth's two-sum: its error is a double
  const double added = sum - start.seconds;
  const double lost = (start.seconds - (sum - added)) + (duration - added);
  const double rest = start.rest + lost;
  const double seconds = sum + rest;
  return {seconds, rest - (seconds - sum)};
}

/// The parabola (or straight line) that a sphere follows, given by its position and velocity at the
/// instant when its motion last changed. One cache line. Internal to native/.
struct alignas(64) Motion {
  Vec3 position = Vec3::Zero();  ///< m, world frame, at `since`
  Vec3 velocity = Vec3::Zero();  ///< m/s, world frame, at `since`
  Instant since;

  Motion at(const Instant& instant, const Vec3& acceleration) const {
    const double flight = elapsed(since, instant);
    const Vec3 gained = flight * acceleration;
    return {position + flight * (velocity + 0.5 * gained), velocity + gained, instant};
  }
};

}  // namespace carom
