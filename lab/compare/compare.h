#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "lab/compare/collision_match.h"

#include "carom/audio/result.h"
#include "scenes/format/scene.h"
#include "scenes/limits/run_guard.h"

namespace carom::lab {

using namespace scenes;

/// One Bullet run at one step. The errors are local: each collision that the bridge reports against
/// the exact collision of the path that Bullet took (LocalReference). The global difference is
/// against the native stepper's own run, matched pair by pair until the two diverge.
struct CompareRun {
  double step = 0.0;  ///< s
  CollisionMatch local;
  CommonRun global;
  double levelDifference = 0.0;  ///< dB, rms of the sound of the Bullet run over native's
  double wallTime = 0.0;         ///< s, of the Bullet run with its bridge, without sound
};

struct CompareReport {
  std::uint64_t nativeCollisions = 0;
  double nativeWallTime = 0.0;  ///< s, without sound
  std::vector<CompareRun> runs;
};

struct CompareOptions {
  std::function<void(double share)> progress = {};
  RunGuard* guard = nullptr;  ///< if not null, ends each run at its limits, which is an error
};

/// Runs the scene on the native stepper and on Bullet at each of the steps (s). Refuses scenes that
/// Bullet cannot run (validateForBullet). [one thread]
Result<CompareReport> compareScene(const Scene& scene, std::span<const double> steps,
                                   const CompareOptions& options = {});

}  // namespace carom::lab
