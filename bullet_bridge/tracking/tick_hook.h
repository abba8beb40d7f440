#pragma once

#include <btBulletDynamicsCommon.h>

namespace carom::bullet {

/// Calls back at the start and at the end of every internal substep of a world, and leaves the
/// world's own slots to its host.
///
/// The end comes through btActionInterface, of which a world has any number. The start has a single
/// slot, Bullet's pre-tick callback, without a getter: the hook takes it over and calls the host's
/// callback first, so that the forces that it applies are seen. The world's user info is left
/// alone. When the host sets its own callback later, the hook loses the start of one substep, then
/// takes the slot again (`startsMissed`).
///
/// One hook per world. [physics thread]. The world must outlive the hook.
class TickHook : private btActionInterface {
 public:
  /// dt is the substep, in seconds.
  virtual void onStepStart(double dt) = 0;
  virtual void onStepEnd(double dt) = 0;

  static bool isHooked(const btDynamicsWorld& world);

  TickHook(const TickHook&) = delete;
  TickHook& operator=(const TickHook&) = delete;

 protected:
  explicit TickHook(btDynamicsWorld& world);
  ~TickHook() override;

  btDynamicsWorld& world() const { return world_; }
  int startsMissed() const { return startsMissed_; }

 private:
  static void preTick(btDynamicsWorld* world, btScalar dt);
  void updateAction(btCollisionWorld* world, btScalar dt) final;
  void debugDraw(btIDebugDraw*) final {}
  void takeSlot();

  btDynamicsWorld& world_;
  btInternalTickCallback next_ = nullptr;  // callback that was in the slot before
  bool started_ = false;                   // preTick was called for the substep under way
  int startsMissed_ = 0;
};

}  // namespace carom::bullet
