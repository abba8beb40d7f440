#pragma once

#include <memory>
#include <vector>

#include <btBulletDynamicsCommon.h>

#include "carom/bullet/bullet_bridge.h"

namespace carom {

/// A small Bullet world as a host would build it: Bullet's defaults, frictionless spheres and
/// planes.
class SphereBulletWorld {
 public:
  explicit SphereBulletWorld(double gravity = 0.0) {
    world.setGravity(btVector3(0, btScalar(-gravity), 0));
  }
  ~SphereBulletWorld() {
    while (!bodies.empty())
      remove(*bodies.back());
  }

  struct Ball {
    double radius = 0.05;
    double mass = 1.0;
    Vec3 position = Vec3::Zero();
    Vec3 velocity = Vec3::Zero();
    double restitution = 1.0;  ///< for Bullet, which takes the product of both bodies'
  };

  btRigidBody& addBall(const Ball& ball) {
    shapes.push_back(std::make_unique<btSphereShape>(btScalar(ball.radius)));
    btVector3 inertia;
    shapes.back()->calculateLocalInertia(btScalar(ball.mass), inertia);
    btRigidBody& body = add(btScalar(ball.mass), inertia, ball.restitution);
    btTransform pose = btTransform::getIdentity();
    pose.setOrigin(toBullet(ball.position));
    body.setCenterOfMassTransform(pose);
    body.setLinearVelocity(toBullet(ball.velocity));
    return body;
  }

  btRigidBody& addPlane(const Vec3& normal, double offset, double restitution) {
    shapes.push_back(std::make_unique<btStaticPlaneShape>(toBullet(normal), btScalar(offset)));
    return add(0, btVector3(0, 0, 0), restitution);
  }

  void remove(btRigidBody& body) {
    world.removeRigidBody(&body);
    std::erase_if(bodies, [&](const auto& owned) { return owned.get() == &body; });
  }

  void step(double dt, int count = 1) {
    for (int i = 0; i < count; ++i)
      world.stepSimulation(btScalar(dt), 0);
  }

  static btVector3 toBullet(const Vec3& v) {
    return {btScalar(v.x()), btScalar(v.y()), btScalar(v.z())};
  }
  static Vec3 fromBullet(const btVector3& v) {
    return {double(v.x()), double(v.y()), double(v.z())};
  }

 private:
  btRigidBody& add(btScalar mass, const btVector3& inertia, double restitution) {
    bodies.push_back(std::make_unique<btRigidBody>(mass, nullptr, shapes.back().get(), inertia));
    btRigidBody& body = *bodies.back();
    body.setRestitution(btScalar(restitution));
    body.setFriction(0);
    world.addRigidBody(&body);
    return body;
  }

  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;

 public:
  btDiscreteDynamicsWorld world{&dispatcher_, &broadphase_, &solver_, &configuration_};
  std::vector<std::unique_ptr<btCollisionShape>> shapes;
  std::vector<std::unique_ptr<btRigidBody>> bodies;
};

}  // namespace carom
