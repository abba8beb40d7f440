#pragma once

#include <map>
#include <utility>
#include <vector>

#include "carom/audio/contact_state.h"

namespace carom::audio {

/// Returns how a contact stands still at a time (s) where its last step has ended: it only damps
/// what rings. [any thread]
ContactState stillAt(const ContactState& contact, double time);

/// The latest step of each contact that is under way. What lies still is told once, when it comes
/// to lie: a sound that begins later is told by this what damps the bodies that ring. [one thread]
class OpenContacts {
 public:
  /// Takes note of a step of a contact, or of its end.
  void note(const ContactState& contact);
  /// Forgets the contacts of a body. Returns their ends, at a time (s).
  std::vector<ContactState> remove(BodyId body, double time);

  /// Returns all contacts as they stand still at a time (s), in the order of their bodies.
  std::vector<ContactState> at(double time) const;

 private:
  std::map<std::pair<BodyId, BodyId>, ContactState> contacts_;
};

}  // namespace carom::audio
