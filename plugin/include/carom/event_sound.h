#pragma once

#include <memory>

#include <carom/audio/contact_state.h>
#include <carom/audio/impulse_event.h>
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
  /// Takes note that the simulation has come to `seconds`, and sends off what was posted. Beyond
  /// 1e9 nothing happens. The clock begins at 0: if it begins elsewhere, call this before the first
  /// `post`. A clock that goes back begins anew there, and is counted as a jump; what was posted
  /// before is heard all the same.
  void advanceTo(double seconds);

 private:
  explicit EventSound(std::shared_ptr<plugin::SoundSession> session);
};

}  // namespace carom
