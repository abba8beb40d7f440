#pragma once

#include <btBulletDynamicsCommon.h>

#include "bullet_bridge/tracking/substep_clock.h"
#include "carom/bullet/bullet_bridge.h"

namespace carom::bullet {

/// The data that all parts of one bridge share: the world, what the host chose, the clock, and the
/// counters.
struct BridgeContext {
  btDynamicsWorld& world;
  const BulletBridgeSettings settings;
  SubstepClock clock = {};
  BulletBridgeCounters counters = {};
};

}  // namespace carom::bullet
