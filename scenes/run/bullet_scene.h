#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <btBulletDynamicsCommon.h>

#include "scenes/format/scene.h"
#include "scenes/run/bullet_solid.h"

namespace carom::scenes {

/// A scene as a Bullet world. It keeps Bullet's defaults except where they would change the
/// mechanics that the scene describes: it has the scene's friction, no damping, and bodies fall
/// asleep only below the scene's rest speed. Body i of the world is body i of the scene. For scenes
/// that Bullet can run (see validateForBullet); what Bullet cannot do is left out of others.
/// [one thread]
///
/// A scene with solids also gets all of the tuning in world_advice.h: with the defaults, flat
/// bodies lose up to half of their bounce on a plane. Scenes without solids keep the defaults,
/// unless they ask for the tuning (StepperSettings::tuned).
///
/// Restitutions of pairs of materials, friction that solids have by their material, and rolling
/// resistance need hooks: Bullet knows bodies only, and has one function for the whole process that
/// combines such a property of two bodies (gCalculateCombinedRestitutionCallback and its like).
/// While there is a scene that needs them, these functions are ours: they answer for two bodies of
/// such scenes, and pass all other pairs to the function that was installed before, which is put
/// back when the last of these scenes goes. So any number of worlds, ours and others, may live side
/// by side; but since Bullet reads those slots without a lock, no world may step on another thread
/// while the first such scene is made or the last one goes. Scenes without such properties leave
/// the slots alone.
class BulletScene {
 public:
  explicit BulletScene(const Scene& scene);
  ~BulletScene();
  BulletScene(const BulletScene&) = delete;
  BulletScene& operator=(const BulletScene&) = delete;

  btDiscreteDynamicsWorld& world() { return world_; }
  const btRigidBody& body(std::size_t index) const { return *bodies_[index]; }
  btRigidBody& body(std::size_t index) { return *bodies_[index]; }

  /// Orientation, body to world, of the frame in which the scene describes the body (SolidShape),
  /// if Bullet's own frame of the body has the orientation `bullet`. The two differ for a solid
  /// whose axes are not principal.
  Quat orientation(std::size_t index, const Quat& bullet) const;
  /// True if the two frames of any body differ.
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
  std::vector<Quat> frames_;  // by body: from Bullet's frame to the scene's
  bool hasTurnedFrames_ = false;
};

/// Returns the names of two bodies that overlap at the start, of which one can move, by more than
/// `depth` of the smaller one's bounding radius; empty if none do. Bullet finds them, so it is for
/// scenes that Bullet can run. [any thread, with the caution above]
std::pair<std::string, std::string> overlapAtStart(const Scene& scene, double depth = 0.02);

/// True if Bullet's solver pushed two bodies apart at this point in the last step. Points beyond
/// the distance that the solver works on keep the impulse of an earlier step (see tune).
inline bool isPushed(const btPersistentManifold& manifold, const btManifoldPoint& point) {
  return point.getAppliedImpulse() > 0 &&
         point.getDistance() <= manifold.getContactProcessingThreshold();
}

}  // namespace carom::scenes
