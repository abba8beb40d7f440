#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "carom/sound_settings.h"

namespace carom::test {

/// Finds steps in a signal that should have none: the sound of a gap, of a click that is cut, or of
/// a gain that jumps. Contacts that last many samples leave next to nothing near half the sample
/// rate; a step has as much there as anywhere.
class GlitchDetector {
 public:
  GlitchDetector();

  void push(std::span<const float> samples);
  /// Begins with a new signal; earlier samples no longer count.
  void restart();

  std::uint64_t glitches() const { return glitches_; }
  std::uint64_t notFinite() const { return notFinite_; }
  /// The largest share of the local peak that was found near half the sample rate.
  double worst() const { return worst_; }

 private:
  void examine();

  std::vector<double> taps_;
  std::vector<double> window_;  // a ring of the latest samples
  std::size_t next_ = 0;
  std::uint64_t seen_ = 0;
  std::uint64_t quietUntil_ = 0;
  std::uint64_t glitches_ = 0;
  std::uint64_t notFinite_ = 0;
  double worst_ = 0.0;
};

struct AbuseSettings {
  double seconds = 600.0;  ///< s of sound
  std::uint64_t seed = 1;
  /// True if bodies may slide as well. A slide that is cut off in its midst (because a body goes,
  /// or a clock leaps) is heard as a click, so that there may be glitches then.
  bool slides = false;
};

struct AbuseReport {
  double seconds = 0.0;  ///< s of sound, from either of the two
  std::uint64_t notFinite = 0;
  std::uint64_t glitches = 0;
  double worst = 0.0;  ///< see GlitchDetector::worst
  double peak = 0.0;   ///< Pa
  std::uint64_t steps = 0, stalls = 0, bursts = 0, added = 0, removed = 0, notNumbers = 0,
                insideBodies = 0, rateChanges = 0, pauses = 0, slowMotions = 0;
  SoundStatistics ofWorld;   ///< statistics of a Sound over a Bullet world
  SoundStatistics ofEvents;  ///< statistics of an EventSound under bursts
  double memoryBegin = 0.0;  ///< MB resident after a third of the time
  double memoryEnd = 0.0;    ///< MB resident at the end

  std::string text() const;
};

/// Runs minutes, in simulated time, of a host that misuses everything: a world whose bodies come,
/// go and lose their numbers, whose steps stall and hurry, listeners within bodies, sample rates
/// that change; and beside it an engine of events that gets bursts of 1e5. All bodies are of
/// rubber, whose contacts last long enough for GlitchDetector. [one thread]
AbuseReport abuse(const AbuseSettings& settings);

}  // namespace carom::test
