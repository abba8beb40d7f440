#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "audio/acceleration_noise.h"
#include "audio/impulse_event.h"
#include "audio/listener.h"
#include "audio/medium.h"
#include "audio/result.h"
#include "audio/sound_body.h"

namespace carom {

/// Hearing begins at 20 uPa (ISO 389-7 at 1 kHz, rounded); 120 dB above it is 20 Pa.
inline constexpr double kHearingThreshold = 20e-6;  ///< Pa

/// Which of the two impulses of an event sounds.
enum class ImpulseChoice : std::uint8_t {
  physical,  ///< ImpulseEvent::impulse
  applied,   ///< ImpulseEvent::appliedImpulse, if the mechanics has given one
};

struct SynthSettings {
  double sampleRate = 48000.0;  ///< Hz, 8000 to 192000
  ImpulseChoice impulse = ImpulseChoice::physical;
  Medium medium = {};
  /// Pa. A click whose peak stays below it at every listener is left out, and counted.
  double audibleThreshold = kHearingThreshold;
};

struct SynthCounters {
  std::uint64_t events = 0;     ///< scheduled, of bodies that can move
  std::uint64_t immovable = 0;  ///< shares of bodies that no impulse moves: silent in this model
  std::uint64_t inaudible = 0;  ///< of `events`, left out: below the threshold at every listener
  std::uint64_t late = 0;       ///< of `events`, began before the first sample still to be rendered
  std::uint64_t undersampled =
      0;  ///< of `events`, contact shorter than 4 samples: aliased, see the class
  std::uint64_t rejected = 0;  ///< not finite, unknown body, or no approach: never sounded
};

/// The sound layer: from impulse events to pressure at listeners.
///
/// Model: a rigid sphere's acceleration noise, compact and far field (Howe 2002, eq. 3.8.5), with
/// the acceleration pulse of a Hertz contact in its Gaussian approximation: the seed document's
/// equations (1), (4), (6) to (10). For a body of radius a and mass m, at distance r,
///
///     p(t) = rho0 a^3 cos(theta) / (2 c r) * pi |j| / (2 m tau) * dS/dt(t - r/c; t0, tau)
///     S(t; t0, tau) = exp(-6/tau^2 (t - t0 - tau/2)^2)
///
/// theta is the angle between the impulse on the body and the direction from its centre to the
/// listener: positive pressure where the body is pushed towards the listener and speeds up.
///
/// Deviations: the Gaussian is cut where it has fallen below double rounding (2.5 tau from its
/// centre); a listener inside a body hears it as from its surface (r >= a).
/// Not modelled yet: what a sample cannot hold. The pulse is evaluated at the samples at its exact,
/// fractional time, so contacts shorter than about 4 samples alias (`undersampled` counts them;
/// docs/acceleration_noise.md has the error).
///
/// Deterministic, and independent of the block size: the set of events alone decides the bits, not
/// the order of the calls of `schedule` nor how `render` is cut into blocks, as long as each event
/// is handed over before its sound begins. A late event is heard from the next sample on.
/// Single-threaded: one thread at a time, any. `render` neither throws nor allocates. Memory holds
/// what is still to sound, and one fixed block per listener.
class Synth {
 public:
  /// Refuses: sample rate or medium out of range, no listener, a listener that is not finite.
  static Result<Synth> create(const SynthSettings& settings, std::vector<Listener> listeners);

  /// Says what `id` radiates as, from now on. Refuses values outside SoundBody's ranges.
  Status setBody(BodyId id, const SoundBody& body);

  /// Hands over one body's share of a collision. May allocate.
  /// To be heard whole, the event is handed over at least `leadTime` before the clock of `render`
  /// reaches it (less the delay to the nearest listener).
  void schedule(const ImpulseEvent& event);

  /// Adds nothing to what is there: overwrites `frames` samples of each channel, one channel per
  /// listener, in pascals, and advances the clock by frames / sampleRate.
  /// Requires channels.size() == listeners().size(). Defined for float and double.
  template <class Sample>
  void render(std::span<Sample* const> channels, std::size_t frames) noexcept;

  /// Sets the clock to the sample nearest to `seconds` (simulation clock) and drops what has not
  /// sounded yet: for a world whose clock does not begin at 0, and for replays.
  Status seek(double seconds);

  /// s, simulation clock, of the next sample to be rendered.
  double time() const { return static_cast<double>(position_) / settings_.sampleRate; }
  /// s: how long before its own time the sound of a contact of duration tau begins (the Gaussian
  /// has a tail before first touch), at no distance: 2 tau.
  static double leadTime(double contactDuration) {
    return (kPulseHalfWidth - 0.5) * contactDuration;
  }

  const std::vector<Listener>& listeners() const { return listeners_; }
  const SynthCounters& counters() const { return counters_; }

  /// Clicks still to be sounded, one per event and listener: those begun and those waiting.
  std::size_t pendingClicks() const { return waiting_.size() + sounding_.size(); }

  /// s, the Hertz duration of the contact of `event`; 0 where a body is unknown or the event has
  /// no duration (not finite, nothing approaching).
  double contactDuration(const ImpulseEvent& event) const;

 private:
  Synth(const SynthSettings& settings, std::vector<Listener> listeners);

  const SoundBody* findBody(BodyId id) const;
  void scheduleImpulse(const ImpulseEvent& event);
  bool makeClicks(const ImpulseEvent& event, const SoundBody& body, double duration);
  bool anyAudible() const;
  void countTiming(double duration);
  void enqueueClicks();
  void reserveSounding();
  void beginUntil(std::int64_t end) noexcept;
  void mix(std::size_t frames) noexcept;

  SynthSettings settings_;
  std::vector<Listener> listeners_;
  std::unordered_map<BodyId, SoundBody> bodies_;
  SynthCounters counters_;

  std::int64_t position_ = 0;           // the next sample to be rendered
  std::vector<SampledClick> clicks_;    // of the event in hand, one per listener
  std::vector<SampledClick> waiting_;   // min-heap, the earliest first
  std::vector<SampledClick> sounding_;  // in the order in which they are summed
  std::vector<double> mix_;             // Pa, kMixFrames per listener, planar
};

}  // namespace carom
