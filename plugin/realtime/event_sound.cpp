#include "carom/event_sound.h"

#include <utility>

#include "plugin/realtime/sound_session.h"

namespace carom {

using namespace plugin;

EventSound::EventSound(std::unique_ptr<SoundSession> session) : SoundOutput(std::move(session)) {}

Result<EventSound> EventSound::create(const SoundSettings& settings) {
  Result<std::unique_ptr<SoundSession>> session = SoundSession::create(settings);
  if (!session) return session.error();
  EventSound sound(*std::move(session));
  if (settings.play)
    if (const Status playing = sound.play(); !playing) return playing.error();
  // The recording comes last: once begun, it replaces the file, whatever comes of the rest.
  if (!settings.record.empty())
    if (const Status recording = sound.record(settings.record); !recording)
      return recording.error();
  return sound;
}

Status EventSound::setBody(BodyId id, const SoundBody& body) {
  if (Status open = session_->requireOpen(); !open) return open;
  return session_->setBody(id, body);
}

void EventSound::removeBody(BodyId id) {
  session_->removeBody(id);
}

void EventSound::post(const ImpulseEvent& event) {
  session_->post(event);
}

void EventSound::updateContact(const ContactState& contact) {
  session_->updateContact(contact);
}

void EventSound::advanceTo(double seconds) {
  session_->advanceTo(seconds);
}

}  // namespace carom
