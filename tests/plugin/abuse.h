#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "carom/sound_settings.h"

namespace carom::test {

/// Finds steps in a signal that has none: what a sound card makes of a gap, of a click that is cut,
/// or of a gain that jumps. Contacts that last many samples leave next to nothing next to half the
/// sample rate; a step has as much there as anywhere.
class GlitchDetector {
 public:
  GlitchDetector();

  void push(std::span<const float> samples);
  /// The signal begins anew; what was before does not count any more.
  void restart();

  std::uint64_t glitches() const { return glitches_; }
  std::uint64_t notFinite() const { return notFinite_; }
  /// The largest share of the local peak that lay next to half the sample rate.
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
  double seconds = 600.0;  ///< of sound
  std::uint64_t seed = 1;
  /// Bodies may slide as well. What cuts a slide off in its midst (a body that goes, a clock that
  /// leaps) is heard as a click, so there may be glitches then.
  bool slides = false;
};

struct AbuseReport {
  double seconds = 0.0;  ///< of sound, from either of the two
  std::uint64_t notFinite = 0;
  std::uint64_t glitches = 0;
  double worst = 0.0;  ///< see GlitchDetector
  double peak = 0.0;   ///< Pa
  std::uint64_t steps = 0, stalls = 0, bursts = 0, added = 0, removed = 0, notNumbers = 0,
                insideBodies = 0, rateChanges = 0, pauses = 0, slowMotions = 0;
  SoundStatistics ofWorld;   ///< of a Sound over a Bullet world
  SoundStatistics ofEvents;  ///< of an EventSound under bursts
  double memoryBegin = 0.0;  ///< MB, resident, after a third of the time
  double memoryEnd = 0.0;    ///< MB

  std::string text() const;
};

/// Minutes of a host that does everything wrong, in simulated time: a world whose bodies come, go
/// and lose their numbers, whose steps stall and hurry, listeners within bodies, sample rates that
/// change; and beside it an engine of events that gets bursts of 1e5. All of rubber, whose contacts
/// last long enough for GlitchDetector. [one thread]
AbuseReport abuse(const AbuseSettings& settings);

}  // namespace carom::test
