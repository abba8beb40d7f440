#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "lab/compare/collision_match.h"
#include "lab/report/report_choices.h"
#include "lab/report/signal_error.h"
#include "lab/view/view_run.h"

#include "carom/audio/result.h"
#include "scenes/format/scene.h"
#include "scenes/limits/run_guard.h"
#include "scenes/run/plan.h"

namespace carom::lab {

using namespace scenes;

/// Wall time per simulated second (s/s): medians of the runs.
struct RunTime {
  double mechanics = 0.0;  ///< stepper, and the bridge where there is one
  double sound = 0.0;      ///< from events to samples, without preparations made once
  double spread = 0.0;     ///< dimensionless, of the runs' sums: (longest - shortest) / median
  std::size_t runs = 0;

  double total() const { return mechanics + sound; }
};

/// The reference for the collisions of a Bullet run.
enum class LocalKind {
  none,   ///< no reference: the mechanics are those of the reference run
  path,   ///< the exact collisions of the path that Bullet took (LocalReference)
  bridge  ///< the bridge's on the same path, with exact times: for solids and large scenes
};

/// One variant of a scene, measured. Quantities that could not be measured are empty.
struct VariantReport {
  ReportChoice choice;
  RunTime runTime;
  std::optional<std::size_t> memory;  ///< bytes, peak heap of stepper plus that of sound

  // Local errors: against the exact collisions on the same path.
  LocalKind local = LocalKind::none;
  std::optional<CollisionMatch> events;
  /// Dimensionless, see waveformError: this sound against
  /// the reference's sound of the exact collisions.
  std::optional<double> localWaveformError;

  // Global errors: against the reference's run.
  double divergedAt = std::numeric_limits<double>::infinity();  ///< s, see CommonRun
  double comparedUntil = 0.0;                                   ///< s, divergedAt or the end
  std::optional<double> waveformError;                          ///< dimensionless, up to then
  std::optional<AlignedError> aligned;                          ///< that error at the best delay
  std::vector<BandDifference> bands;                            ///< over the whole length
  /// Dimensionless: mechanical energy less the reference's at `comparedUntil`, divided by the
  /// reference's largest kinetic energy.
  std::optional<double> energyDrift;
  std::optional<double> positionError;  ///< m, of a jello's points: rms over points and times

  std::vector<std::string> notes;
  Signal signal;  ///< Pa, as long as the scene
};

/// A choice that was not run.
struct VariantLeftOut {
  std::string label;
  std::string why;
};

struct SceneReport {
  Scene scene;
  Plan plan;  ///< that of the reference run
  std::string referenceWhy;
  std::vector<VariantReport> variants;  ///< the reference is the first
  std::vector<VariantLeftOut> leftOut;
  std::vector<std::string> shown;  ///< ids of those that ReportOptions::show has taken
  std::string page;                ///< name of the file that shows them; empty: there is none
};

struct ReportOptions {
  std::size_t runs = 3;  ///< >= 1, runs of each variant that is timed
  double budget = 10.0;  ///< s, > 0: a variant whose mechanics would take longer is left out
  /// Called before each variant with the share of the scene that is done, and its label.
  std::function<void(double share, const std::string& label)> progress = {};
  /// If not null, ends the report at its limits, which is an error; those of events and rattles are
  /// of each run.
  RunGuard* guard = nullptr;
  /// Is handed each variant to be seen and heard, its id and label set, the reference first;
  /// returns whether it has taken it, and is asked for no more once `isFull` says so. An error ends
  /// the report. Empty: nothing is shown.
  std::function<Result<bool>(const ViewRun&)> show = {};
  std::function<bool()> isFull = {};
};

/// Runs a scene in all ways that reportGrid has for it, and measures them. Errors: a scene that the
/// reference cannot run. [one thread]
Result<SceneReport> reportScene(const Scene& scene, const ReportOptions& options);

}  // namespace carom::lab
