#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "audio/scheduling/sample_time.h"
#include "carom/sound_settings.h"

namespace carom::plugin {

/// The outcome of a step of the simulation, compared with the samples that went by.
enum class TimelineStep : std::uint8_t {
  steady,
  started,  ///< begins anew, after nothing, a pause, or a time that the simulation ran ahead
  stalled,  ///< the simulation had fallen behind: it goes on later
  jumped,   ///< its clock went back: it goes on from there
  skipped,  ///< no samples are taken, or the simulation runs ahead: the step is not heard
};

/// True if what happened at `time` (s) was before a leap of the clock from `from` to `to`: by which
/// of the two it is nearer to.
inline bool isBeforeLeap(double time, double from, double to) {
  return std::abs(time - from) < std::abs(time - to);
}

/// Maps the clock of the simulation to that of the samples, which cannot be held up.
///
/// Simulation and sound card count seconds of slightly different length, and a simulation pauses,
/// stalls and jumps. Only events are shifted, whose own sound does not depend on when they come: so
/// nothing is resampled. The time t of an event falls on the sample
///
///     t * rate + shift(t)
///
/// and only the shift changes: a whole number of samples while all goes well, so that the samples
/// have the bits that they have offline.
///
/// After each step, the time reached should lie `latency` ahead of what has been rendered. What is
/// missing from that, smoothed over kSmoothing, is the drift. Steps and blocks are lumps, so a
/// drift is left alone up to kTolerance of the latency; a larger one is taken back within some
/// kRecovery, but by at least kLeastSlew and at most kMostSlew of the time that goes by, until it
/// is kSettled: meanwhile events are heard nearer together or farther apart, at their own pitch.
/// Less than kLeast of the latency left is a stall: the shift is set anew, and the silence stays as
/// long as it is. A simulation that is ahead by more than kMostAhead is not followed: its events
/// are skipped until it has kept to time for as long as the latency.
///
/// [simulation thread]
class SoundTimeline {
 public:
  static constexpr double kSmoothing = 0.5;   ///< s
  static constexpr double kTolerance = 0.25;  ///< share of the latency
  static constexpr double kSettled = 0.03;    ///< share of the latency
  static constexpr double kRecovery = 2.0;    ///< s
  static constexpr double kLeastSlew = 0.005;
  static constexpr double kMostSlew = 0.1;
  static constexpr double kLeast = 0.25;      ///< share of the latency
  static constexpr double kMostAhead = 0.25;  ///< s, beyond the latency

  SoundTimeline(SoundClock clock, double sampleRate, double latency)
      : clock_(clock), rate_(sampleRate), latency_(latency * sampleRate) {}

  /// Takes note that the simulation has come to `time` (s) and `rendered` samples have been
  /// rendered.
  TimelineStep advance(double time, std::int64_t rendered);
  /// Returns the shift of events that happen at `time` (s); none for a time that no clock has, of
  /// which the scheduler says why.
  audio::SampleShift shiftAt(double time) const;

  /// Samples that go on where the clock has gone back (SoundClock::simulation).
  std::int64_t leapt() const { return leapt_; }

  void pause() { resting_ = true; }
  void setScale(double scale);

 private:
  TimelineStep followClock(double time);
  void anchor(double time, std::int64_t rendered);
  void bend(double time, double drift);
  double shift(double time) const;

  SoundClock clock_;
  double rate_;     // Hz
  double latency_;  // samples
  double scale_ = 1.0;
  bool anchored_ = false;
  bool resting_ = false;
  bool slewing_ = false;
  std::int64_t heldUntil_ = 0;  // samples rendered at which a simulation that was ahead is followed
  bool held_ = false;
  double time_ = 0.0;  // s, end of the latest step
  std::int64_t leapt_ = 0;
  double drift_ = 0.0;  // samples by which the look-ahead is too short

  struct Piece {
    double since = 0.0;  // s
    double shift = 0.0;  // samples, at `since`
    double slope = 0.0;  // samples per second of the simulation
  };
  /// Pieces of the shift, the newest first: an event is older than the step in which it becomes
  /// known, by up to two substeps.
  std::array<Piece, 4> pieces_{};
};

}  // namespace carom::plugin
