#pragma once

#include "bullet_bridge/bodies/body_tracker.h"
#include "bullet_bridge/broad_phase/swept_box.h"

namespace carom::bullet {

/// Returns the box of a body over the substep that has just ended: around the path that it took
/// and, if `speculative`, around the path on which Bullet's solver may act on a gap. Not for
/// planes. The field `body` is left to the caller.
SweptBox sweptBox(const TrackedBody& body, double dt, bool speculative);

/// Returns a box around a body that is at rest, from Bullet's own box for the start of the substep.
SweptBox boxAtRest(const TrackedBody& body);

}  // namespace carom::bullet
