#pragma once

#include <btBulletDynamicsCommon.h>

namespace carom::bullet {

class TickHook;

/// Told what a WorldGuard notices of its world.
class GuardedWorld {
 public:
  /// In each substep, between the search for contacts and the solver: bodies are where they were at
  /// its start.
  virtual void onIslands() = 0;
  virtual void onWorldEnd() = 0;

 protected:
  ~GuardedWorld() = default;
};

/// The island manager of a world, in the place of the world's own one, whose work it does in the
/// same way: a world destroys its island manager, and nothing else that could tell of its end.
class WorldGuard {
 public:
  /// Puts a guard into the world. Returns nullptr, and changes nothing, if the island manager is of
  /// a class of the host's.
  static WorldGuard* place(btDiscreteDynamicsWorld& world, GuardedWorld& guarded);
  /// Gives the world its own manager back, with the settings of the present one, and destroys the
  /// guard. Not while the world builds islands.
  virtual void remove(btDiscreteDynamicsWorld& world) = 0;

 protected:
  ~WorldGuard() = default;
};

/// The part of a TickHook that Bullet holds. It lives until no substep can have it in hand: a host
/// may end a hook in any callback, and Bullet's loop over the actions of a world skips one if
/// another goes. [physics thread]
class WorldTap final : private btActionInterface, private GuardedWorld {
 public:
  /// Returns the tap of a world, or nullptr if it has none. [any thread]
  static WorldTap* find(const btDynamicsWorld& world);
  /// Returns the tap of a world; makes one if it has none.
  static WorldTap& of(btDiscreteDynamicsWorld& world);

  TickHook* hook() const { return hook_; }
  void setHook(TickHook* hook);
  /// Forgets the hook, and destroys itself, now or at the end of the substep.
  void release();

 private:
  /// The action after all others, in substeps in which the tap is not the last one.
  class LastAction final : public btActionInterface {
   public:
    explicit LastAction(WorldTap& tap) : tap_(tap) {}
    void updateAction(btCollisionWorld*, btScalar) override;
    void debugDraw(btIDebugDraw*) override {}

   private:
    WorldTap& tap_;
  };

  explicit WorldTap(btDiscreteDynamicsWorld& world);
  ~WorldTap() override;
  static void preTick(btDynamicsWorld* world, btScalar dt);
  void beginStep(btScalar dt);
  void callHost(btScalar dt);
  void updateAction(btCollisionWorld* world, btScalar dt) override;
  void debugDraw(btIDebugDraw*) override {}
  void onIslands() override;
  void onWorldEnd() override;
  void takeSlot();
  void noteLateStart();
  bool isLastAction() const;
  void endStep();
  void dismantle();

  btDiscreteDynamicsWorld& world_;
  TickHook* hook_ = nullptr;
  WorldGuard* guard_;
  LastAction last_{*this};
  btInternalTickCallback next_ = nullptr;  // callback that was in the slot before
  bool started_ = false;                   // the hook knows the start of the substep under way
  bool inStep_ = false;                    // from the pre-tick callback to the last action
  bool isCalling_ = false;                 // the callback that was in the slot before
};

}  // namespace carom::bullet
