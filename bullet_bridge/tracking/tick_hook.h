#pragma once

#include <btBulletDynamicsCommon.h>

namespace carom::bullet {

class WorldTap;

/// Calls back at the start and at the end of every internal substep of a world, and leaves the
/// world's own slots to its host.
///
/// The end comes through btActionInterface, of which a world has any number. The start has a single
/// slot, Bullet's pre-tick callback, without a getter: the hook takes it over and calls the host's
/// callback first, so that the forces that it applies are seen. The world's user info is left
/// alone. When the host sets its own callback later, the hook loses the start of one substep, then
/// takes the slot again (`startsMissed`).
///
/// One hook per world. It may detach, and be destroyed, in any callback of a substep, if it
/// outlives its own (`onStepStart`, `onStepEnd`). The world may die first (see WorldGuard).
/// [physics thread]
class TickHook {
 public:
  /// dt is the substep, in seconds.
  virtual void onStepStart(double dt) = 0;
  virtual void onStepEnd(double dt) = 0;

  static bool isHooked(const btDynamicsWorld& world);

  TickHook(const TickHook&) = delete;
  TickHook& operator=(const TickHook&) = delete;

  /// Ends the callbacks, and gives the world back what the hook has taken: at the end of the
  /// substep if one is under way. Does nothing the second time.
  void detach();
  /// False once the world has died, or the hook is detached.
  bool isAttached() const { return tap_ != nullptr; }

 protected:
  explicit TickHook(btDiscreteDynamicsWorld& world);
  virtual ~TickHook() { detach(); }

  btDiscreteDynamicsWorld& world() const { return world_; }
  int startsMissed() const { return startsMissed_; }

 private:
  friend class WorldTap;

  btDiscreteDynamicsWorld& world_;
  WorldTap* tap_;  // belongs to the world; null once it no longer calls
  int startsMissed_ = 0;
};

}  // namespace carom::bullet
