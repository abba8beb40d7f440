#pragma once

#include <memory>
#include <vector>

#include <btBulletDynamicsCommon.h>

#include "scenes/scene.h"

namespace carom {

/// A scene as a Bullet world, with Bullet's own defaults but for what would change the mechanics
/// that the scene describes: no friction, no damping, and bodies fall asleep only below the scene's
/// rest speed. Body i of the world is body i of the scene. [one thread]
class BulletScene {
 public:
  explicit BulletScene(const Scene& scene);
  ~BulletScene();
  BulletScene(const BulletScene&) = delete;
  BulletScene& operator=(const BulletScene&) = delete;

  btDiscreteDynamicsWorld& world() { return world_; }
  const btRigidBody& body(std::size_t index) const { return *bodies_[index]; }

 private:
  void addBody(const SceneBody& body, double restSpeed);
  std::unique_ptr<btRigidBody> makeSphere(const SphereShape& sphere);
  std::unique_ptr<btRigidBody> makePlane(const PlaneShape& plane);

  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_{&dispatcher_, &broadphase_, &solver_, &configuration_};
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
};

}  // namespace carom
