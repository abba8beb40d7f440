#pragma once

#include <memory>

#include <carom/audio/contact_state.h>
#include <carom/audio/impulse_event.h>
#include <carom/audio/listener.h>
#include <carom/audio/result.h>
#include <carom/audio/sound_body.h>
#include <carom/sound_output.h>
#include <carom/sound_settings.h>

namespace carom {

/// The sound of events from any physics engine, in real time or into a file.
///
///     auto sound = carom::EventSound::create({.play = true});  // Result<EventSound>
///     sound->setBody(0, body);                                 // once for each body
///     sound->post(event), sound->advanceTo(time);              // in each step
///
/// Outputs, listeners, the clock and statistics are those of SoundOutput, which also says which
/// thread calls what.
class EventSound : public SoundOutput {
 public:
  /// Refuses what Synth and Limiter refuse, and settings out of the ranges that SoundSettings
  /// gives; with SoundSettings::record also what `record` refuses.
  static Result<EventSound> create(const SoundSettings& settings = {});

  /// Says what a body radiates as, from now on. Refuses what Synth::setBody refuses.
  Status setBody(BodyId id, const SoundBody& body);
  /// Removes a body: its events are rejected from now on, but its present sound goes on.
  void removeBody(BodyId id);

  /// Posts one body's share of a collision; its time is that of the simulation's clock. A share
  /// that cannot sound is counted in SoundStatistics::rejected.
  void post(const ImpulseEvent& event);
  /// Posts a lasting contact, over one step: bodies that slide or roll over bumps sound, and what
  /// rings in bodies that press on each other is damped (see Synth::updateContact). One that is not
  /// finite or between unknown bodies is ignored; steps that no sample can hold are counted in
  /// SoundStatistics::rejectedSlides.
  void updateContact(const ContactState& contact);
  /// Says where a body is at `pose.time` (s, clock of the simulation): its origin and axes, as
  /// ImpulseEvent has them. What rings is followed by that: distance, delay with Doppler effect and
  /// direction. To be called after each step, before `advanceTo`, for bodies that move and may
  /// ring; of others nothing comes of it, and a body of which no pose comes stands where it was
  /// struck. A time not after the last one begins anew; so does a jump, by which the body's
  /// velocity changes by more than 15 m/s from one pose to the next: it is heard at its new place
  /// within 10 ms, without Doppler effect. Refuses: no such body, a place beyond 1e12 m, an
  /// orientation that is not of unit length, a time beyond 1e9.
  Status moveBody(BodyId id, const ListenerPose& pose);
  /// Takes note that the simulation has come to `seconds`, and sends off what was posted. Beyond
  /// 1e9 nothing happens. The clock begins at 0: if it begins elsewhere, call this before the first
  /// `post`. A clock that goes back begins anew there, and is counted as a jump; what was posted
  /// before is heard all the same.
  void advanceTo(double seconds);

 private:
  explicit EventSound(std::shared_ptr<plugin::SoundSession> session);
};

}  // namespace carom
