#pragma once

#include "bullet_bridge/tracking/pair_motion.h"
#include "bullet_bridge/tracking/solved_contact.h"
#include "bullet_bridge/tracking/substep_clock.h"
#include "carom/audio/contact_state.h"

namespace carom::bullet {

/// Returns the lasting contact of a pair over the substep that has just ended, from the impulses by
/// which Bullet's solver held it. `start` is where the two were nearest as it began. `phase` is
/// left to the caller.
ContactState contactStateOf(const PairMotion& now, const Proximity& start,
                            const SolvedContact& solved, const SubstepTime& substep);

}  // namespace carom::bullet
