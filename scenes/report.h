#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "carom/audio/result.h"
#include "scenes/collision_match.h"
#include "scenes/plan.h"
#include "scenes/report_choices.h"
#include "scenes/scene.h"
#include "scenes/signal_error.h"

namespace carom::scenes {

/// s of wall time for a simulated second: medians of the runs.
struct RunTime {
  double mechanics = 0.0;  ///< stepper, and the bridge where there is one
  double sound = 0.0;      ///< from events to samples, without what is made once before
  double spread = 0.0;     ///< 1, of the sums of the runs: (longest - shortest) / median
  std::size_t runs = 0;

  double total() const { return mechanics + sound; }
};

/// What the collisions of a Bullet run are held against.
enum class LocalKind {
  none,   ///< nothing: its mechanics are the reference's
  path,   ///< the exact collisions of the path that Bullet took (LocalReference)
  bridge  ///< what the bridge finds on the same path, with exact times: of solids, and large scenes
};

/// One variant of a scene, measured. What could not be measured is empty.
struct VariantReport {
  ReportChoice choice;
  RunTime runTime;
  std::optional<std::size_t> memory;  ///< bytes of heap at most: stepper, and sound

  // Local: against the exact collisions on the same path.
  LocalKind local = LocalKind::none;
  std::optional<CollisionMatch> events;
  /// 1, see waveformError: of its sound against the reference's sound of the exact collisions.
  std::optional<double> localWaveformError;

  // Global: against the reference's run.
  double divergedAt = std::numeric_limits<double>::infinity();  ///< s, see CommonRun
  double comparedUntil = 0.0;                                   ///< s, divergedAt or the end
  std::optional<double> waveformError;                          ///< 1, up to then
  std::optional<AlignedError> aligned;                          ///< the same, at the best delay
  std::vector<BandDifference> bands;                            ///< of the whole length
  /// 1: mechanical energy less the reference's, there, over its largest kinetic energy.
  std::optional<double> energyDrift;
  std::optional<double> positionError;  ///< m, of a jello's points, rms over 1/60 s and points

  std::vector<std::string> notes;
  Signal signal;  ///< Pa, of the scene's length
};

/// A choice that was not run.
struct VariantLeftOut {
  std::string label;
  std::string why;
};

struct SceneReport {
  Scene scene;
  Plan plan;  ///< of the reference
  std::string referenceWhy;
  std::vector<VariantReport> variants;  ///< the reference is the first
  std::vector<VariantLeftOut> leftOut;
};

struct ReportOptions {
  std::size_t runs = 3;  ///< >= 1, of each variant that is timed
  double budget = 10.0;  ///< s, > 0: a variant whose mechanics would take longer is left out
  /// Called before each variant with the share of the scene that is done, and its label.
  std::function<void(double share, const std::string& label)> progress = {};
};

/// Runs a scene in all ways that reportGrid has for it, and measures them. Errors: what the
/// reference cannot run. [one thread]
Result<SceneReport> reportScene(const Scene& scene, const ReportOptions& options);

}  // namespace carom::scenes
