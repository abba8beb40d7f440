#include "bullet_bridge/tracking/world_tap.h"

#include <algorithm>
#include <new>
#include <typeinfo>
#include <vector>

#include <BulletDynamics/Dynamics/btSimulationIslandManagerMt.h>

#include "audio/model/mutex.h"
#include "bullet_bridge/tracking/tick_hook.h"

namespace carom::bullet {
namespace {

// These members are protected and have no getter; a pointer to member through a derived class is
// the legal way to them.
struct WorldAccess : btDiscreteDynamicsWorld {
  static btInternalTickCallback& preTick(btDiscreteDynamicsWorld& world) {
    return world.*(&WorldAccess::m_internalPreTickCallback);
  }
  static btSimulationIslandManager*& islandManager(btDiscreteDynamicsWorld& world) {
    return world.*(&WorldAccess::m_islandManager);
  }
  static btAlignedObjectArray<btActionInterface*>& actions(btDiscreteDynamicsWorld& world) {
    return world.*(&WorldAccess::m_actions);
  }
};

/// Removes an action, wherever it is, and leaves the others in their order, which Bullet does not.
void removeInOrder(btDiscreteDynamicsWorld& world, const btActionInterface* action) {
  btAlignedObjectArray<btActionInterface*>& actions = WorldAccess::actions(world);
  int kept = 0;
  for (int at = 0; at < actions.size(); ++at)
    if (actions[at] != action) actions[kept++] = actions[at];
  while (actions.size() > kept)
    actions.pop_back();
}

void copySettings(btSimulationIslandManager& from, btSimulationIslandManager& to) {
  to.setSplitIslands(from.getSplitIslands());
}

void copySettings(btSimulationIslandManagerMt& from, btSimulationIslandManagerMt& to) {
  to.setSplitIslands(from.getSplitIslands());
  to.setMinimumSolverBatchSize(from.getMinimumSolverBatchSize());
  to.setIslandDispatchFunction(from.getIslandDispatchFunction());
}

// Bullet has made the manager, and frees it, in this way.
void destroy(btSimulationIslandManager* manager) {
  manager->~btSimulationIslandManager();
  btAlignedFree(manager);
}

template <class Manager>
class GuardingManager final : public Manager, public WorldGuard {
 public:
  static WorldGuard* place(btDiscreteDynamicsWorld& world, GuardedWorld& guarded) {
    btSimulationIslandManager*& slot = WorldAccess::islandManager(world);
    void* const place = btAlignedAlloc(sizeof(GuardingManager), 16);
    auto* const guard = new (place) GuardingManager(static_cast<Manager&>(*slot), guarded);
    slot = guard;
    return guard;
  }
  GuardingManager(const GuardingManager&) = delete;
  GuardingManager& operator=(const GuardingManager&) = delete;
  ~GuardingManager() override {
    if (own_ == nullptr) return;
    destroy(own_);
    guarded_.onWorldEnd();
  }
  void updateActivationState(btCollisionWorld* world, btDispatcher* dispatcher) override {
    guarded_.onIslands();
    Manager::updateActivationState(world, dispatcher);
  }
  void remove(btDiscreteDynamicsWorld& world) override {
    copySettings(*this, *own_);
    WorldAccess::islandManager(world) = own_;
    own_ = nullptr;
    destroy(this);
  }

 private:
  GuardingManager(Manager& own, GuardedWorld& guarded) : own_(&own), guarded_(guarded) {
    copySettings(own, *this);
  }

  Manager* own_;  // the world's own manager; null once it has been given back
  GuardedWorld& guarded_;
};

// A pre-tick callback gets the world and no context (the user info belongs to the host), so the
// taps of the process are found by their world. Worlds may be stepped on different threads.
struct Registry {
  struct Entry {
    const btDynamicsWorld* world;
    WorldTap* tap;
  };
  audio::Mutex mutex;
  std::vector<Entry> entries;
};

// Never destroyed: worlds and sounds may be static, and outlive whatever is made after them.
Registry& registry() {
  static Registry& instance = *new Registry;
  return instance;
}

}  // namespace

WorldGuard* WorldGuard::place(btDiscreteDynamicsWorld& world, GuardedWorld& guarded) {
  const btSimulationIslandManager* const manager = WorldAccess::islandManager(world);
  if (manager == nullptr) return nullptr;
  if (typeid(*manager) == typeid(btSimulationIslandManager))
    return GuardingManager<btSimulationIslandManager>::place(world, guarded);
  if (typeid(*manager) == typeid(btSimulationIslandManagerMt))
    return GuardingManager<btSimulationIslandManagerMt>::place(world, guarded);
  return nullptr;
}

WorldTap* WorldTap::find(const btDynamicsWorld& world) {
  const audio::MutexLock lock(registry().mutex);
  const auto& entries = registry().entries;
  const auto found = std::ranges::find(entries, &world, &Registry::Entry::world);
  return found == entries.end() ? nullptr : found->tap;
}

WorldTap& WorldTap::of(btDiscreteDynamicsWorld& world) {
  WorldTap* const present = find(world);
  return present != nullptr ? *present : *new WorldTap(world);
}

WorldTap::WorldTap(btDiscreteDynamicsWorld& world)
    : world_(world), guard_(WorldGuard::place(world, *this)) {
  {
    const audio::MutexLock lock(registry().mutex);
    registry().entries.push_back({&world, this});
  }
  takeSlot();
  world_.addAction(this);
  // Before the host's actions, which may change what the solver has left, or remove bodies.
  auto& actions = WorldAccess::actions(world_);
  for (int place = actions.size() - 1; place > 0; --place)
    actions.swap(place, place - 1);
}

WorldTap::~WorldTap() {
  const audio::MutexLock lock(registry().mutex);
  std::erase_if(registry().entries,
                [this](const Registry::Entry& entry) { return entry.tap == this; });
}

/// Gives the world back what the tap has taken. A callback that the host has put over ours stays:
/// it is the host's wish.
void WorldTap::dismantle() {
  removeInOrder(world_, this);
  removeInOrder(world_, &last_);
  btInternalTickCallback& slot = WorldAccess::preTick(world_);
  if (slot == &WorldTap::preTick) slot = next_;
  if (guard_ != nullptr) guard_->remove(world_);
}

void WorldTap::setHook(TickHook* hook) {
  hook_ = hook;
  started_ = false;
  takeSlot();
}

void WorldTap::release() {
  hook_ = nullptr;
  if (inStep_) return;
  dismantle();
  delete this;
}

void WorldTap::onWorldEnd() {
  if (hook_ != nullptr) hook_->tap_ = nullptr;
  delete this;
}

void WorldTap::takeSlot() {
  btInternalTickCallback& slot = WorldAccess::preTick(world_);
  if (slot == &WorldTap::preTick) return;
  next_ = slot;
  slot = &WorldTap::preTick;
}

void WorldTap::preTick(btDynamicsWorld* world, btScalar dt) {
  if (WorldTap* const tap = find(*world)) tap->beginStep(dt);
}

/// Calls what was in the slot before, which may throw.
void WorldTap::callHost(btScalar dt) {
  struct Calling {
    explicit Calling(bool& flag) : flag_(flag) { flag_ = true; }
    Calling(const Calling&) = delete;
    Calling& operator=(const Calling&) = delete;
    ~Calling() { flag_ = false; }
    bool& flag_;
  };
  const Calling calling(isCalling_);
  if (next_ != nullptr) next_(&world_, dt);
}

void WorldTap::beginStep(btScalar dt) {
  // A host that keeps what was in the slot, ours, and calls it from its own callback, which we
  // call.
  if (isCalling_) return;
  inStep_ = true;
  callHost(dt);
  if (hook_ == nullptr) return;
  started_ = true;
  hook_->onStepStart(static_cast<double>(dt));
}

/// The host has taken the slot, so that its callback was called and ours was not.
void WorldTap::noteLateStart() {
  ++hook_->startsMissed_;
  takeSlot();
}

void WorldTap::onIslands() {
  if (hook_ == nullptr || started_) return;
  inStep_ = true;
  noteLateStart();
  started_ = true;
  hook_->onStepStart(static_cast<double>(world_.getDispatchInfo().m_timeStep));
}

void WorldTap::updateAction(btCollisionWorld*, btScalar dt) {
  inStep_ = true;
  if (hook_ != nullptr && !started_) noteLateStart();
  if (hook_ != nullptr) hook_->onStepEnd(static_cast<double>(dt));
  started_ = false;
  if (isLastAction()) return endStep();
  // It is still there where the host's actions have thrown, or have removed themselves.
  if (WorldAccess::actions(world_).findLinearSearch(&last_) == WorldAccess::actions(world_).size())
    world_.addAction(&last_);
}

void WorldTap::LastAction::updateAction(btCollisionWorld*, btScalar) {
  tap_.world_.removeAction(this);
  tap_.endStep();
}

bool WorldTap::isLastAction() const {
  const auto& actions = WorldAccess::actions(world_);
  return actions.size() > 0 && actions[actions.size() - 1] == this;
}

void WorldTap::endStep() {
  inStep_ = false;
  if (hook_ == nullptr) release();
}

}  // namespace carom::bullet
