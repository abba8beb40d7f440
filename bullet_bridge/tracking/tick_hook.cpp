#include "bullet_bridge/tracking/tick_hook.h"

#include <algorithm>
#include <vector>

#include "audio/model/mutex.h"

namespace carom::bullet {
namespace {

// The slot is protected and has no getter; a pointer to member through a derived class is the
// legal way to it.
struct SlotAccess : btDynamicsWorld {
  static btInternalTickCallback& preTick(btDynamicsWorld& world) {
    return world.*(&SlotAccess::m_internalPreTickCallback);
  }
};

// A pre-tick callback gets the world and no context (the user info belongs to the host), so the
// hooks of the process are found by their world. Worlds may be stepped on different threads.
struct Registry {
  audio::Mutex mutex;
  std::vector<std::pair<btDynamicsWorld*, TickHook*>> hooks;
};

Registry& registry() {
  static Registry instance;
  return instance;
}

TickHook* findHook(const btDynamicsWorld* world) {
  const audio::MutexLock lock(registry().mutex);
  for (const auto& [hooked, hook] : registry().hooks) {
    if (hooked == world) return hook;
  }
  return nullptr;
}

}  // namespace

bool TickHook::isHooked(const btDynamicsWorld& world) {
  return findHook(&world) != nullptr;
}

TickHook::TickHook(btDynamicsWorld& world) : world_(world) {
  {
    const audio::MutexLock lock(registry().mutex);
    registry().hooks.emplace_back(&world, this);
  }
  takeSlot();
  world_.addAction(this);
}

TickHook::~TickHook() {
  world_.removeAction(this);
  // A callback that the host has put over ours stays: it is the host's wish.
  btInternalTickCallback& slot = SlotAccess::preTick(world_);
  if (slot == &TickHook::preTick) slot = next_;
  const audio::MutexLock lock(registry().mutex);
  std::erase(registry().hooks, std::pair<btDynamicsWorld*, TickHook*>(&world_, this));
}

void TickHook::takeSlot() {
  btInternalTickCallback& slot = SlotAccess::preTick(world_);
  if (slot == &TickHook::preTick) return;
  next_ = slot;
  slot = &TickHook::preTick;
}

void TickHook::preTick(btDynamicsWorld* world, btScalar dt) {
  TickHook* hook = findHook(world);
  if (hook == nullptr) return;
  hook->started_ = true;
  if (hook->next_ != nullptr) hook->next_(world, dt);
  hook->onStepStart(static_cast<double>(dt));
}

void TickHook::updateAction(btCollisionWorld*, btScalar dt) {
  if (!started_) {
    ++startsMissed_;
    takeSlot();
  }
  onStepEnd(static_cast<double>(dt));
  started_ = false;
}

}  // namespace carom::bullet
