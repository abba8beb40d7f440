#include "carom/event_sound.h"

#include <utility>

#include "plugin/realtime/sound_session.h"

namespace carom {

using namespace plugin;

EventSound::EventSound(std::shared_ptr<SoundSession> session) : SoundOutput(std::move(session)) {}

Result<EventSound> EventSound::create(const SoundSettings& settings) {
  const auto session = std::make_shared<SoundSession>(settings);
  if (const Status prepared = session->told(session->prepare()); !prepared) return prepared.error();
  EventSound sound(session);
  if (const Status begun = session->told(session->begin()); !begun) return begun.error();
  return sound;
}

Status EventSound::setBody(BodyId id, const SoundBody& body) {
  return onOpen(session_, [&](SoundSession& session) { return session.setBody(id, body); });
}

void EventSound::removeBody(BodyId id) {
  if (session_) session_->removeBody(id);
}

void EventSound::post(const ImpulseEvent& event) {
  if (session_) session_->post(event);
}

void EventSound::updateContact(const ContactState& contact) {
  if (session_) session_->updateContact(contact);
}

Status EventSound::moveBody(BodyId id, const ListenerPose& pose) {
  return onOpen(session_, [&](SoundSession& session) { return session.moveBody(id, pose); });
}

void EventSound::advanceTo(double seconds) {
  if (session_) session_->advanceTo(seconds);
}

}  // namespace carom
