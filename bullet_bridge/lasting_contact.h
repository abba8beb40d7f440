#pragma once

#include "bullet_bridge/pair_motion.h"
#include "bullet_bridge/solved_contact.h"
#include "carom/audio/contact_state.h"

namespace carom::bullet {

/// The substep that has just ended, in the world's time: s.
struct SubstepTime {
  double start = 0.0;
  double length = 0.0;
};

/// The lasting contact of a pair over that substep, from what Bullet's solver held it with. `start`
/// is where the two were nearest as it began. `phase` is left to the caller.
ContactState lastingContact(const PairMotion& now, const Proximity& start,
                            const SolvedContact& solved, const SubstepTime& substep);

}  // namespace carom::bullet
