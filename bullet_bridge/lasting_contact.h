#pragma once

#include "audio/contact_state.h"
#include "bullet_bridge/pair_motion.h"
#include "bullet_bridge/solved_contact.h"

namespace carom {

/// The lasting contact of a pair over the substep that has just ended, from what Bullet's solver
/// held it with. `phase` is left to the caller.
ContactState lastingContact(const PairMotion& now, const SolvedContact& solved, double time,
                            double dt);

}  // namespace carom
