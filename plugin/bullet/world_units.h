#pragma once

#include "carom/audio/contact_state.h"
#include "carom/audio/impulse_event.h"

namespace carom::plugin {

// Worlds whose unit of length is not the metre: what the bridge reports in units is turned into
// metres before it sounds. Masses are in kg and times in s whatever the unit. `metres` is the
// length of a unit (m). [any thread]

ImpulseEvent inMetres(const ImpulseEvent& event, double metres);
ContactState inMetres(const ContactState& contact, double metres);

}  // namespace carom::plugin
