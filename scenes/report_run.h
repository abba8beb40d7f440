#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "carom/audio/result.h"
#include "scenes/collision_match.h"
#include "scenes/contact_poller.h"
#include "scenes/event_tape.h"
#include "scenes/report_choices.h"
#include "scenes/signal_error.h"

namespace carom::scenes {

/// The mechanics of a variant, run: what `carom report` measures it by.
struct MechanicsRun {
  /// What bodies have at one time.
  struct Energy {
    double time = 0.0;       // s
    double kinetic = 0.0;    // J
    double potential = 0.0;  // J
  };

  std::shared_ptr<const EventTape> tape;
  std::vector<double> seconds;            ///< s, wall time of each run
  std::optional<std::size_t> memory;      ///< bytes of heap at most; empty: heapInUse cannot tell
  std::vector<Energy> energies;           ///< ascending in time
  std::vector<std::vector<Vec3>> places;  ///< m, of a jello's points, every 1/60 s from 0 on

  // On Bullet only.
  std::unique_ptr<BulletScene> world;  ///< that the poller looks at
  std::unique_ptr<ContactPoller> poller;
  /// Of the exact collisions of the path; empty where nobody looked (too many pairs, solids).
  std::optional<std::vector<ImpulseEvent>> exact;
};

/// s, about what a run of a scene with a jello takes: from its first steps. 0 of other scenes.
/// [one thread]
Result<double> expectedSeconds(const Scene& scene);

/// Runs it `runs` times, but only once where a run takes longer than kLongRun, after one that is
/// not timed and followed by one to look at what happens. [one thread]
Result<MechanicsRun> runMechanics(const Scene& scene, std::size_t runs);

inline constexpr double kLongRun = 1.0;  ///< s

/// Its events as the choice would have them: with other times, with Bullet's own impulses.
/// [any thread]
EventTape chosenTape(const MechanicsRun& run, const ReportChoice& choice);

/// Its contacts and what deforms, with other events. [any thread]
EventTape withEvents(const EventTape& tape, const std::vector<ImpulseEvent>& events);

/// What is heard of a tape.
struct SoundRun {
  Signal signal;
  std::vector<double> seconds;        ///< s, wall time of each run
  std::optional<std::size_t> memory;  ///< bytes of heap at most, as of the mechanics
};

/// [one thread]
Result<SoundRun> runSound(const Scene& scene, const std::shared_ptr<const EventTape>& tape,
                          std::size_t runs);

}  // namespace carom::scenes
