#pragma once

#include "bullet_bridge/tracking/pair_motion.h"
#include "bullet_bridge/tracking/solved_contact.h"
#include "bullet_bridge/tracking/substep_clock.h"
#include "carom/audio/contact_state.h"

namespace carom::bullet {

/// The curvatures of the two bodies of a pair where they touch, and when they were found.
struct PairCurvature {
  LocalShape body;
  LocalShape other;
  double turned = -1.0;  ///< m, sum of both bodies' TrackedBody::turned then; negative if unknown
  Vec3 apart = Vec3::Zero();  ///< m, from the other body's centre to the body's then
};

/// Returns the curvatures of a pair where it is nearest at the start.
PairCurvature curvatureOf(const PairMotion& now, const Proximity& start);

/// Returns the lasting contact of a pair over the substep that has just ended, from the impulses by
/// which Bullet's solver held it. `now` is the actual motion, with the orientation of spheres, too.
/// `start` is where the two were nearest as it began; only
/// its places and its normal are read, and only if the solver held the pair by no impulse. `phase`
/// is left to the caller.
ContactState contactStateOf(const PairMotion& now, const Proximity& start,
                            const PairCurvature& curvature, const SolvedContact& solved,
                            const SubstepTime& substep);

}  // namespace carom::bullet
