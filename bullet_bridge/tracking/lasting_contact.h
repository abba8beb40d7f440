#pragma once

#include "bullet_bridge/tracking/pair_motion.h"
#include "bullet_bridge/tracking/solved_contact.h"
#include "carom/audio/contact_state.h"

namespace carom::bullet {

/// Start and length (s, world's time) of the substep that has just ended.
struct SubstepTime {
  double start = 0.0;
  double length = 0.0;
};

/// Returns the lasting contact of a pair over that substep, from the impulses by which Bullet's
/// solver held it. `start` is where the two were nearest as it began. `phase` is left to the
/// caller.
ContactState lastingContact(const PairMotion& now, const Proximity& start,
                            const SolvedContact& solved, const SubstepTime& substep);

}  // namespace carom::bullet
