#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "carom/audio/impulse_event.h"

namespace carom::scenes {

/// One collision of a run: which pair, when, how hard.
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

/// What errors add up to.
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

/// From events: of the two shares of each, that of the lower id, in order of time. [any thread]
std::vector<Collision> collisionsOf(std::span<const ImpulseEvent> events);

/// How a run's collisions agree with exact ones of the same path.
struct CollisionMatch {
  std::uint64_t reference = 0;  ///< collisions of the reference
  std::uint64_t matched = 0;    ///< of these, reported
  std::uint64_t missed = 0;     ///< of these, not reported
  std::uint64_t spurious = 0;   ///< reported, but not in the reference
  ErrorSummary timeError;       ///< s, of the matched
  ErrorSummary impulseError;    ///< relative, of the matched
};

/// Each reported collision takes the nearest of the reference that is of its pair, still free, and
/// not farther away than `window` (s). [any thread]
CollisionMatch matchCollisions(std::span<const Collision> reported,
                               std::span<const Collision> reference, double window);

/// How far two runs of one scene go together: their collisions agree pair by pair, in order, until
/// one is missing, or off by more than a limit.
struct CommonRun {
  double divergedAt = std::numeric_limits<double>::infinity();  ///< s
  std::uint64_t compared = 0;                                   ///< collisions before
  ErrorSummary difference;                                      ///< s, of their times
};

/// `limit` in s. [any thread]
CommonRun commonRun(std::span<const Collision> run, std::span<const Collision> reference,
                    double limit);

}  // namespace carom::scenes
