#pragma once

#include <memory>
#include <vector>

#include <btBulletDynamicsCommon.h>

#include "carom/audio/vector.h"

namespace carom::bench {

/// The state in which a body starts.
struct BodyStart {
  double mass = 0.0;  ///< kg; 0: static
  Vec3 position = Vec3::Zero();
  Quat orientation = Quat::Identity();
  Vec3 velocity = Vec3::Zero();
  Vec3 angularVelocity = Vec3::Zero();
  double restitution = 1.0;
  double friction = 0.0;
};

/// A Bullet world with Bullet's default settings, but memory for few contacts, so that thousands of
/// worlds are made quickly.
class PairWorld {
 public:
  explicit PairWorld(double gravity) { world.setGravity(btVector3(0, btScalar(-gravity), 0)); }
  ~PairWorld() {
    for (const auto& body : bodies)
      world.removeRigidBody(body.get());
  }

  /// Adds a body; the world keeps its shape alive.
  btRigidBody& add(std::shared_ptr<btCollisionShape> shape, const BodyStart& start) {
    btVector3 inertia(0, 0, 0);
    if (start.mass > 0.0) shape->calculateLocalInertia(btScalar(start.mass), inertia);
    bodies.push_back(
        std::make_unique<btRigidBody>(btScalar(start.mass), nullptr, shape.get(), inertia));
    shapes_.push_back(std::move(shape));
    btRigidBody& body = *bodies.back();
    const Quat& turned = start.orientation;
    body.setCenterOfMassTransform(
        btTransform(btQuaternion(btScalar(turned.x()), btScalar(turned.y()), btScalar(turned.z()),
                                 btScalar(turned.w())),
                    toBullet(start.position)));
    body.setLinearVelocity(toBullet(start.velocity));
    body.setAngularVelocity(toBullet(start.angularVelocity));
    body.setRestitution(btScalar(start.restitution));
    body.setFriction(btScalar(start.friction));
    world.addRigidBody(&body);
    return body;
  }

  static btVector3 toBullet(const Vec3& v) {
    return {btScalar(v.x()), btScalar(v.y()), btScalar(v.z())};
  }

 private:
  static btDefaultCollisionConstructionInfo smallPools() {
    btDefaultCollisionConstructionInfo info;
    info.m_defaultMaxPersistentManifoldPoolSize = 64;
    info.m_defaultMaxCollisionAlgorithmPoolSize = 64;
    return info;
  }

  btDefaultCollisionConfiguration configuration_{smallPools()};
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  std::vector<std::shared_ptr<btCollisionShape>> shapes_;

 public:
  btDiscreteDynamicsWorld world{&dispatcher_, &broadphase_, &solver_, &configuration_};
  std::vector<std::unique_ptr<btRigidBody>> bodies;
};

}  // namespace carom::bench
