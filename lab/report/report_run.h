#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "lab/compare/collision_match.h"
#include "lab/compare/contact_poller.h"
#include "lab/report/report_choices.h"
#include "lab/report/signal_error.h"

#include "carom/audio/result.h"
#include "scenes/recording/event_tape.h"

namespace carom::lab {

using namespace scenes;

/// The results of running a variant's mechanics, which `carom report` measures.
struct MechanicsRun {
  /// The energies of all bodies at one time.
  struct Energy {
    double time = 0.0;       // s
    double kinetic = 0.0;    // J
    double potential = 0.0;  // J
  };

  std::shared_ptr<const EventTape> tape;
  std::vector<double> seconds;            ///< s, wall time of each run
  std::optional<std::size_t> memory;      ///< bytes, peak heap; empty: heapInUse cannot tell
  std::vector<Energy> energies;           ///< ascending in time
  std::vector<std::vector<Vec3>> places;  ///< m, of a jello's points, every 1/60 s from 0 on

  // On Bullet only.
  std::unique_ptr<BulletScene> world;  ///< the world of `poller`
  std::unique_ptr<ContactPoller> poller;
  /// Events of the exact collisions of the path; empty if
  /// they were not computed (too many pairs, solids).
  std::optional<std::vector<ImpulseEvent>> exact;
};

/// How often something is run.
struct RunsOptions {
  std::size_t runs = 1;
  RunGuard* guard = nullptr;  ///< if not null, looks on: a run that it ends is an error
};

/// Estimates the time that a run of a scene with a jello takes, in s, from its first steps; 0 for
/// other scenes. A guard, if any, looks on. [one thread]
Result<double> expectedSeconds(const Scene& scene, RunGuard* guard);

/// Returns the scene with a sound for which events have the applied impulses too: they serve all
/// variants, those that use these and those that do not. [any thread]
Scene withAllImpulses(const Scene& scene);

/// Runs the scene so many times, but only once if a run takes longer than kLongRun. Before these
/// comes a run that is not timed, after them one that observes the bodies. [one thread]
Result<MechanicsRun> runMechanics(const Scene& scene, const RunsOptions& options);

inline constexpr double kLongRun = 1.0;  ///< s, wall time

/// Returns the time (s) at which the choice has an event of the run be heard. [any thread]
double heardTime(const ImpulseEvent& event, const MechanicsRun& run, const ReportChoice& choice);
/// Returns the run's tape with the event times of the choice. [any thread]
EventTape chosenTape(const MechanicsRun& run, const ReportChoice& choice);

/// Returns the tape with its contacts and deformations, but other events. [any thread]
EventTape withEvents(const EventTape& tape, const std::vector<ImpulseEvent>& events);

/// The sound of a tape.
struct SoundRun {
  Signal signal;
  std::vector<double> seconds;        ///< s, wall time of each run
  std::optional<std::size_t> memory;  ///< bytes, peak heap, as of MechanicsRun
};

/// Renders the sound of the tape so many times. [one thread]
Result<SoundRun> runSound(const Scene& scene, const std::shared_ptr<const EventTape>& tape,
                          const RunsOptions& options);

}  // namespace carom::lab
