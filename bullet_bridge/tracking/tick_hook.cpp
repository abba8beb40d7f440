#include "bullet_bridge/tracking/tick_hook.h"

#include "bullet_bridge/tracking/world_tap.h"

namespace carom::bullet {

bool TickHook::isHooked(const btDynamicsWorld& world) {
  const WorldTap* const tap = WorldTap::find(world);
  return tap != nullptr && tap->hook() != nullptr;
}

TickHook::TickHook(btDiscreteDynamicsWorld& world) : world_(world), tap_(&WorldTap::of(world)) {
  tap_->setHook(this);
}

void TickHook::detach() {
  if (tap_ == nullptr) return;
  WorldTap& tap = *tap_;
  tap_ = nullptr;
  tap.release();
}

}  // namespace carom::bullet
