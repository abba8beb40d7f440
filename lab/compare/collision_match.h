#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "carom/audio/impulse_event.h"

namespace carom::lab {

/// A collision of a run: its pair, time and impulse.
struct Collision {
  BodyId body = 0;  ///< the lower of the two ids
  BodyId other = 0;
  double time = 0.0;     ///< s
  double impulse = 0.0;  ///< N s, magnitude
};

struct ErrorSummary {
  double rms = 0.0;
  double max = 0.0;  ///< largest magnitude
};

/// Accumulates errors to their root mean square and maximum.
class ErrorSum {
 public:
  void add(double error);
  std::uint64_t count() const { return count_; }
  ErrorSummary summary() const;

 private:
  double sumOfSquares_ = 0.0;
  double max_ = 0.0;
  std::uint64_t count_ = 0;
};

/// Returns the collisions of the events in order of time, one from each pair of shares: that of the
/// lower id. [any thread]
std::vector<Collision> collisionsOf(std::span<const ImpulseEvent> events);

/// Agreement of a run's collisions with the exact ones of the same path.
struct CollisionMatch {
  std::uint64_t reference = 0;  ///< collisions of the reference
  std::uint64_t matched = 0;    ///< collisions of the reference that were reported
  std::uint64_t missed = 0;     ///< collisions of the reference that were not reported
  std::uint64_t spurious = 0;   ///< reported, but not in the reference
  ErrorSummary timeError;       ///< s, of the matched collisions
  ErrorSummary impulseError;    ///< relative, of the matched collisions
};

/// Matches each reported collision with the nearest one of the reference that is of the same pair,
/// still free, and not farther away than `window` (s). [any thread]
CollisionMatch matchCollisions(std::span<const Collision> reported,
                               std::span<const Collision> reference, double window);

/// The part that two runs of one scene have in common: their collisions agree pair by pair, in
/// order, until one is missing, or off by more than a limit.
struct CommonRun {
  double divergedAt = std::numeric_limits<double>::infinity();  ///< s
  std::uint64_t compared = 0;                                   ///< collisions before `divergedAt`
  ErrorSummary difference;                                      ///< s, of their times until then
};

/// Compares two runs; `limit` is the largest difference of times that agree, in s. [any thread]
CommonRun commonRun(std::span<const Collision> run, std::span<const Collision> reference,
                    double limit);

}  // namespace carom::lab
