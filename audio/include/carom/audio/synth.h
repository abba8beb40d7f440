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
/// Model: acceleration noise. A rigid body that is hit pushes the air as a dipole (Strike) while
/// the contact lasts (hertzDuration), with the force's own course over time (Pulse). Sound reaches
/// each receiver of each listener directly and over the images of a room's walls, with the delay
/// and loudness of its way (RadiationFilter: near field and size of the body included), Doppler
/// shift from the motion of body and listener, and the walls' absorption; what is left of the room
/// is a Reverb. Positive pressure comes first where the body is pushed towards the listener.
///
/// Band-limited: pulses are put on the samples at their exact, fractional times by short
/// convolution, of which nothing folds back into the band below 0.4167 of the sample rate
/// (kBand); docs/acceleration_noise.md has the errors.
///
/// Deviations: within a click the distance changes by a parabola through its begin, middle and
/// end, and with it the loudness; what that change adds for a listener who moves (his speed over
/// that of sound, times the near field) is not taken away. A body that moves sounds like a point
/// force that does (Lowson 1965). A listener inside a body hears it as from its surface. Bodies
/// larger than kLargestRadius are filtered as of that radius.
///
/// Deterministic, and independent of the block size: the set of events alone decides the bits, not
/// the order of the calls of `schedule` nor how `render` is cut into blocks, as long as each event
/// is handed over before its sound begins. A late event is heard from the next sample on.
/// Single-threaded: one thread at a time, any. `render` neither throws nor allocates. Memory holds
/// what is still to sound.
class Synth {
 public:
  static constexpr double kLargestRadius = kLargestFilteredRadius;  ///< m

  /// Refuses: sample rate or medium out of range, no listener, a listener or a room that is not
  /// valid (see there), a binaural listener whose responses cannot be loaded.
  static Result<Synth> create(const SynthSettings& settings, std::vector<Listener> listeners);
  Synth(Synth&&) noexcept;
  Synth& operator=(Synth&&) noexcept;
  ~Synth();

  /// Says what `id` radiates as, from now on. Refuses values outside SoundBody's ranges. Bodies of
  /// the first RadiationBank::kOwn sizes have filters of their own, later sizes share some: so the
  /// order of these calls can be heard, at -98 dB.
  Status setBody(BodyId id, const SoundBody& body);

  /// Its events are rejected from now on; what it sounds goes on.
  void removeBody(BodyId id);

  /// The next pose of a listener that moves. Until the first call, it stands where it was created;
  /// the first pose may be of any time and place, and the listener stands there at all times
  /// before. See PoseTrack for what lies between poses and after the last. What is heard of an
  /// event is decided when it is scheduled. Refuses: no such listener, a pose that PoseTrack
  /// refuses.
  Status moveListener(std::size_t listener, const ListenerPose& pose);

  /// The listener is there, and was so always: for what is too far away to have travelled to.
  /// Refuses: no such listener, a pose that is not finite or not of unit length.
  Status placeListener(std::size_t listener, const ListenerPose& pose);

  /// Hands over one body's share of a collision. May allocate.
  /// To be heard whole, the event is handed over at least `leadTime` before the clock of `render`
  /// reaches it (less the delay to the nearest listener).
  void schedule(const ImpulseEvent& event);

  /// A lasting contact, over one step of the mechanics: it damps what rings in the bodies that it
  /// holds together (RingLayer), until it ends; and where it slides or rolls over bumps
  /// (SoundBody::texture), it drives both bodies with the impulses of its way (ContactDrive). One
  /// after the other as time goes by; what comes late counts from the next sample on. May allocate.
  void touch(const ContactState& contact);

  /// Adds nothing to what is there: overwrites `frames` samples of each channel, in pascals, and
  /// advances the clock by frames / sampleRate. The channels are those of the first listener, then
  /// those of the next. Requires channels.size() == channelCount(). Defined for float and double.
  template <class Sample>
  void render(std::span<Sample* const> channels, std::size_t frames) noexcept;

  /// Sets the clock to the sample nearest to `seconds` (simulation clock) and drops what has not
  /// sounded yet: for a world whose clock does not begin at 0, and for replays. Listeners are back
  /// where they were created, and await their first pose.
  Status seek(double seconds);

  /// s, simulation clock, of the next sample to be rendered.
  double time() const;
  /// s: how long before its own time the sound of a contact of that duration (s) begins at no
  /// distance: what a filter without delay rings ahead, what a Gaussian has before first touch, and
  /// by how much an ear can be nearer than the middle of its head.
  double leadTime(double contactDuration) const;

  const std::vector<Listener>& listeners() const;
  std::size_t channelCount() const;
  double sampleRate() const;  ///< Hz
  SynthCounters counters() const;

  /// Clicks still to begin: one per event, channel and path.
  std::size_t pendingClicks() const;
  /// Nothing is sounding, and nothing waits.
  bool isSilent() const;

  /// s, the duration of the contact of `event`; 0 where a body is unknown or the event has no
  /// duration (not finite, nothing approaching).
  double contactDuration(const ImpulseEvent& event) const;

 private:
  class Impl;
  explicit Synth(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace carom
