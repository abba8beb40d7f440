#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "audio/result.h"
#include "scenes/scene.h"

namespace carom {

struct ErrorSummary {
  double rms = 0.0;
  double max = 0.0;
};

/// One Bullet run at one step. The errors are local: each collision that the bridge reports against
/// the exact collision of the path that Bullet took (LocalReference). The global difference is
/// against the native stepper's own run, matched pair by pair until the two diverge.
struct CompareRun {
  double step = 0.0;            ///< s
  std::uint64_t reference = 0;  ///< collisions of the reference
  std::uint64_t matched = 0;    ///< of these, reported by the bridge
  std::uint64_t missed = 0;     ///< of these, not reported
  std::uint64_t spurious = 0;   ///< reported, but not in the reference
  ErrorSummary timeError;       ///< s
  ErrorSummary impulseError;    ///< relative
  std::uint64_t globalCompared = 0;
  ErrorSummary globalDifference;  ///< s
  /// s, where the two runs stop being the same; infinite where they never do.
  double divergedAt = std::numeric_limits<double>::infinity();
  double levelDifference = 0.0;  ///< dB, rms of Bullet's sound over native's
  double wallTime = 0.0;         ///< s, of the Bullet run with its bridge, without sound
};

struct CompareReport {
  std::uint64_t nativeCollisions = 0;
  double nativeWallTime = 0.0;  ///< s, without sound
  std::vector<CompareRun> runs;
};

/// Runs the scene on the native stepper and on Bullet at each of the steps (s). Refuses scenes that
/// Bullet cannot run (whyNotOnBullet). [one thread]
Result<CompareReport> compareScene(const Scene& scene, std::span<const double> steps,
                                   const std::function<void(double share)>& progress = {});

}  // namespace carom
