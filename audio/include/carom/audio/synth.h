#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include <carom/audio/contact_state.h>
#include <carom/audio/impulse_event.h>
#include <carom/audio/listener.h>
#include <carom/audio/result.h>
#include <carom/audio/sound_body.h>
#include <carom/audio/synth_settings.h>

namespace carom {

/// The sound layer: from impulse events to pressure at listeners, in pascals.
///
///     setBody          once:   how each body radiates
///     schedule         when known: one body's share of a collision  --+
///     updateContact    each step: a lasting contact                  --+--> clicks, excited modes,
///     moveListener     each frame, for a listener that moves               on exact sample times
///     moveBody         each step, for a body that rings and moves
///     advanceTo        each step: rings follow what has moved
///     render           block by block                                 <--  their sum, in Pa
///
/// An event is decided when it is scheduled: which paths its sound takes to which listener, when it
/// arrives, how loud. What is left for `render` is to add up pulses through filters that all bodies
/// of a size share, and to let modes ring.
///
/// Model: acceleration noise. A rigid body that is hit pushes the air as a dipole (Strike) while
/// the contact lasts (hertzDuration), with the force's own course over time (Pulse). Sound reaches
/// each receiver of each listener directly and over the images of a room's walls, with the delay
/// and loudness of its path (RadiationFilter: near field and size of the body included), Doppler
/// shift from the motion of body and listener, and the walls' absorption; the rest of the room's
/// response is a Reverb. Positive pressure comes first where the body is pushed towards the
/// listener.
///
/// Band-limited: pulses are put on the samples at their exact, fractional times by a short
/// convolution that folds nothing back into the band below 0.4167 of the sample rate (kBand);
/// docs/acceleration_noise.md has the errors.
///
/// Deviations: within a click the distance, and with it the loudness, follows a parabola through
/// its begin, middle and end; the pressure that this change adds for a moving listener (its speed
/// over that of sound, times the near field) is not taken away. A body that moves sounds like a
/// point force that does (Lowson 1965). A listener inside a body hears it as from its surface.
/// Bodies larger than kLargestRadius are filtered as if they had that radius.
///
/// Deterministic, and independent of the block size: the set of events alone decides the bits, not
/// the order of the calls of `schedule` nor how `render` is cut into blocks, as long as each event
/// is handed over before its sound begins. A late event is heard from the next sample on. Not
/// thread-safe: any thread may call, but one at a time. `render` neither throws nor allocates.
/// Memory holds the sound that is still to be rendered.
class Synth {
 public:
  static constexpr double kLargestRadius = kLargestFilteredRadius;  ///< m

  /// Refuses: sample rate or medium out of range, no listener, a listener or a room that is not
  /// valid (see Listener and Room), a binaural listener whose responses cannot be loaded.
  static Result<Synth> create(const SynthSettings& settings, std::vector<Listener> listeners);
  /// Returns a synth of the same settings and listeners that has heard nothing: with the bits of a
  /// new one, but without designing rooms, heads and filters again.
  Synth fresh() const;
  Synth(Synth&&) noexcept;
  Synth& operator=(Synth&&) noexcept;
  ~Synth();

  /// Sets how the body `id` radiates from now on. Refuses values outside SoundBody's ranges. Bodies
  /// of the first RadiationBank::kOwn sizes have filters of their own, later sizes share some: so
  /// the order of these calls can be heard, at -98 dB.
  Status setBody(BodyId id, const SoundBody& body);

  /// Removes a body: its events are rejected from now on; sound that it has made goes on.
  void removeBody(BodyId id);

  /// Appends the next pose of a moving listener. Until the first call, the listener stands where it
  /// was created; the first pose may be of any time and place, and the listener stands there at all
  /// times before. See PoseTrack for the motion between poses and after the last one. How an event
  /// is heard is decided when it is scheduled. Refuses: no such listener, a pose that PoseTrack
  /// refuses.
  Status moveListener(std::size_t listener, const ListenerPose& pose);

  /// Appends the next pose of a body that rings: its origin and axes, as ImpulseEvent has them. The
  /// ring is followed as the body flies and turns (see advanceTo), with motion between poses as for
  /// a listener; above 180 m/s the body is in its new place at once. For a body that does not ring
  /// nothing comes of it. Refuses: no such body, a pose that is not finite or not of unit length,
  /// or is not later than the last one.
  Status moveBody(BodyId id, const ListenerPose& pose);

  /// Lets rings follow the bodies and listeners that move: all poses and events up to `time` (s,
  /// simulation clock) have been handed over. Rings are followed from the first call on, if the
  /// body moves as it is struck, or a listener has poses; hand over the first pose after an event
  /// before the event itself. Call it at least 512 samples ahead of `render`: a ring of which no
  /// more is known goes on as it did. May allocate.
  void advanceTo(double time);

  /// Teleports the listener and discards the history of its motion: for a place too far away to
  /// have travelled to. Refuses: no such listener, a pose that is not finite or not of unit length.
  Status placeListener(std::size_t listener, const ListenerPose& pose);

  /// Schedules the sound of one body's share of a collision. Returns its peak (Pa) at the loudest
  /// listener: an upper bound of the click's or an estimate of what it sets ringing, the larger; 0
  /// for an event that gives no sound. What cannot reach SynthSettings::audibleThreshold is left
  /// out. May allocate.
  /// To be heard whole, the event is handed over at least `leadTime` before the clock of `render`
  /// reaches it (less the delay to the nearest listener).
  double schedule(const ImpulseEvent& event);

  /// Updates a lasting contact over one step of the mechanics: it damps the ringing of the bodies
  /// that it holds together (ModalExciter), until it ends; and where it slides or rolls over bumps
  /// (SoundBody::texture), it drives both bodies with the impulses along its path (ContactDrive).
  /// Steps are handed over in order of time; a late one counts from the next sample on. May
  /// allocate.
  void updateContact(const ContactState& contact);

  /// Overwrites `frames` samples of each channel, in pascals, and advances the clock by frames /
  /// sampleRate. The channels are those of the first listener, then those of the next; with
  /// SynthSettings::stems, the same again for each Stem. Requires channels.size() ==
  /// channelCount(). Defined for float and double.
  template <class Sample>
  void render(std::span<Sample* const> channels, std::size_t frames) noexcept;

  /// Sets the clock to the sample nearest to `seconds` (simulation clock) and drops all sound that
  /// has not been rendered yet: for a world whose clock does not begin at 0, and for replays.
  /// Listeners return to where they were created, and await their first pose.
  Status seek(double seconds);

  /// Time in s, simulation clock, of the next sample to be rendered.
  double time() const;
  /// Time in s by which the sound of a contact of that duration (s), at no distance, begins before
  /// the contact: the ringing ahead of filters without delay, the part of a Gaussian before first
  /// touch, and the lead of the nearer ear over the middle of its head.
  double leadTime(double contactDuration) const;

  const std::vector<Listener>& listeners() const;
  std::size_t channelCount() const;
  double sampleRate() const;  ///< Hz
  /// Energy of all impacts so far, as of `time` (s, simulation clock): infinity for when all has
  /// died away.
  ContactEnergy contactEnergy(double time) const;
  SynthCounters counters() const;

  /// Number of clicks still to begin: one per event, channel and path.
  std::size_t pendingClicks() const;
  /// True if nothing is sounding and nothing is scheduled.
  bool isSilent() const;

  /// Duration in s of the contact of `event`; 0 if a body is unknown or the event has no duration
  /// (not finite, nothing approaching).
  double contactDuration(const ImpulseEvent& event) const;

 private:
  class Impl;
  explicit Synth(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace carom
