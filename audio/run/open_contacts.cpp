#include "audio/run/open_contacts.h"

namespace carom::audio {

ContactState stillAt(const ContactState& contact, double time) {
  ContactState still = contact;
  still.time = time;
  still.pathStart = contact.pathEnd;
  still.otherPathStart = contact.otherPathEnd;
  still.slipVelocity = still.rollingVelocity = Vec3::Zero();
  return still;
}

void OpenContacts::note(const ContactState& contact) {
  const std::pair pair(contact.body, contact.other);
  if (contact.phase == ContactPhase::end)
    contacts_.erase(pair);
  else
    contacts_.insert_or_assign(pair, contact);
}

std::vector<ContactState> OpenContacts::remove(BodyId body, double time) {
  std::vector<ContactState> ends;
  std::erase_if(contacts_, [&](const auto& entry) {
    const auto& [pair, contact] = entry;
    if (pair.first != body && pair.second != body) return false;
    ContactState& end = ends.emplace_back(stillAt(contact, time));
    end.phase = ContactPhase::end;
    end.normalLoad = 0.0;
    end.appliedImpulse = Vec3::Zero();
    return true;
  });
  return ends;
}

std::vector<ContactState> OpenContacts::at(double time) const {
  std::vector<ContactState> all;
  for (const auto& [pair, contact] : contacts_)
    all.push_back(stillAt(contact, time));
  return all;
}

}  // namespace carom::audio
