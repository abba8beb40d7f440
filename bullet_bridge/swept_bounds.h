#pragma once

#include "bullet_bridge/body_tracker.h"
#include "bullet_bridge/swept_box.h"

namespace carom::bullet {

/// The box of a body over the substep that has just ended: of the way that it went, and, if
/// `speculative`, of the way on which Bullet's solver may act on a gap. Not for planes. `body` is
/// left to the caller.
SweptBox sweptBox(const TrackedBody& body, double dt, bool speculative);

}  // namespace carom::bullet
