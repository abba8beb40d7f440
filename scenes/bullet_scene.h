#pragma once

#include <memory>
#include <vector>

#include <btBulletDynamicsCommon.h>

#include "scenes/bullet_solid.h"
#include "scenes/scene.h"

namespace carom::scenes {

/// A scene as a Bullet world, with Bullet's own defaults but for what would change the mechanics
/// that the scene describes: its friction, no damping, and bodies fall asleep only below the
/// scene's rest speed. Body i of the world is body i of the scene. Only of scenes that Bullet can
/// run, see whyNotOnBullet: of others it leaves out what it cannot do. [one thread]
///
/// A scene with solids is tuned besides (world_advice.h), all of it: with the defaults, flat bodies
/// lose up to half of their bounce on a plane. Scenes without any keep the defaults, unless they
/// ask for the same (StepperSettings::tuned).
///
/// Restitutions of pairs of materials, and what holds up rolling. Bullet knows bodies only, and one
/// function of each for the whole process that combines two of them
/// (gCalculateCombinedRestitutionCallback and its like). While there is a scene that needs them,
/// these functions are ours: they answer for two bodies of such scenes, and hand on all others to
/// what was there before, which comes back with the last of these scenes. So any number of worlds,
/// of ours and of others, may live side by side; but since Bullet reads those slots without a lock,
/// no world may step on another thread while the first such scene is made or the last one goes.
/// Scenes without such things leave the slots alone.
class BulletScene {
 public:
  explicit BulletScene(const Scene& scene);
  ~BulletScene();
  BulletScene(const BulletScene&) = delete;
  BulletScene& operator=(const BulletScene&) = delete;

  btDiscreteDynamicsWorld& world() { return world_; }
  const btRigidBody& body(std::size_t index) const { return *bodies_[index]; }

  /// Body to world, of the frame that the scene describes the body in (SolidShape), where Bullet's
  /// own frame of it has the orientation `bullet`: a solid whose axes are not principal has another
  /// one there.
  Quat orientation(std::size_t index, const Quat& bullet) const;
  /// Whether that is of any body not simply `bullet`.
  bool hasTurnedFrames() const { return hasTurnedFrames_; }

 private:
  const RestitutionTable* table() const { return restitutions_.empty() ? nullptr : &restitutions_; }
  void prepareForSolids();
  void addBody(const SceneBody& body, double restSpeed);
  std::unique_ptr<btRigidBody> makeSphere(const SceneBody& body, const SphereShape& sphere);
  std::unique_ptr<btRigidBody> makePlane(const SceneBody& body, const PlaneShape& plane);
  std::unique_ptr<btRigidBody> makeBlock(const SceneBody& body, const BlockShape& block);
  std::unique_ptr<btRigidBody> makeSolid(const SceneBody& body, const SolidShape& solid);
  std::unique_ptr<btRigidBody> makeBody(const SceneBody& body);

  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_{&dispatcher_, &broadphase_, &solver_, &configuration_};
  RestitutionTable restitutions_;
  bool needsSlots_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<BulletSolid> solids_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  std::vector<Quat> frames_;  // by body: Bullet's to the scene's
  bool hasTurnedFrames_ = false;
};

/// Whether Bullet's solver pushed two bodies apart at this point in the last step. Points beyond
/// the distance that it works on keep the impulse of an earlier one (see tune).
inline bool isPushed(const btPersistentManifold& manifold, const btManifoldPoint& point) {
  return point.getAppliedImpulse() > 0 &&
         point.getDistance() <= manifold.getContactProcessingThreshold();
}

}  // namespace carom::scenes
