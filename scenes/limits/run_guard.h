#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "carom/audio/impulse_event.h"
#include "carom/audio/result.h"
#include "carom/modal/analysis_settings.h"
#include "scenes/format/scene.h"
#include "scenes/limits/resource_watch.h"

namespace carom::scenes {

/// Why a run has ended before the scene has.
struct EndedEarly {
  std::string limit;    ///< "memory", "time", "events" or "rattle"
  std::string what;     ///< one sentence: what grew, where, how far the run came, what to change
  std::string pointer;  ///< JSON pointer to the body that most of it is of; empty if there is none
  double time = 0.0;    ///< s, of the scene, up to which the run is complete
};

/// Watches a run of a scene, and ends it at a limit or where it rattles without end. Only `time`
/// and `memory` depend on the machine. [one thread]
class RunGuard {
 public:
  /// A rattle is this many collisions of one body in a row, less than 1 us apart in the mean.
  static constexpr std::uint32_t kRattle = 200'000;
  static constexpr double kRattlePeriod = 1e-6;  ///< s

  /// `scene` is borrowed.
  RunGuard(const Scene& scene, const RunLimits& limits);

  /// Counts events that the mechanics reports. False if the run has to end.
  bool add(std::span<const ImpulseEvent> events, double time);
  /// Looks at clock and memory; `time` is how far the mechanics is, in s. False if the run has to
  /// end. To be called at least every 0.1 s or so.
  bool mayGoOn(double time);
  /// The same, at the time at which it was asked last: what comes after the mechanics.
  bool mayGoOn() { return mayGoOn(time_); }

  /// Begins another run of the scene, whose events are counted anew; clock and limits go on.
  void restart();

  /// Ends the run because an allocation has failed.
  void runOut();

  const std::optional<EndedEarly>& ended() const { return ended_; }
  std::uint64_t events() const { return events_; }

 private:
  struct Body {
    std::uint64_t events = 0;
    std::uint32_t streak = 0;  // collisions since `since`
    double since = 0.0;        // s
    BodyId other = 0;          // partner of the last collision
  };
  bool addOne(const ImpulseEvent& event);
  void end(std::string limit, const std::string& why, double time);
  void endForMemory(const std::string& why);
  std::string busiest() const;
  std::string nameOf(BodyId body) const;
  std::optional<BodyId> busiestBody() const;

  const Scene& scene_;
  RunLimits limits_;
  std::uint64_t events_ = 0;
  ResourceWatch watch_;
  double time_ = 0.0;  // s, of the scene, at the last look
  std::vector<Body> bodies_;
  std::optional<EndedEarly> ended_;
};

/// Returns the guard's sentence as an error if it has ended the run; null: no guard.
Status checkEnded(const RunGuard* guard);
/// Returns a function that tells `progress`, if any, and ends an analysis where that or the guard
/// does; null: no guard. Both are borrowed.
Progress withinLimits(RunGuard* guard, const Progress& progress);

}  // namespace carom::scenes
