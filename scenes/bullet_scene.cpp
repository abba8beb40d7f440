#include "scenes/bullet_scene.h"

#include <cmath>

namespace carom {
namespace {

btScalar toBullet(double value) {
  return static_cast<btScalar>(value);
}
btVector3 toBullet(const Vec3& v) {
  return {toBullet(v.x()), toBullet(v.y()), toBullet(v.z())};
}

}  // namespace

BulletScene::BulletScene(const Scene& scene) {
  world_.setGravity(toBullet(scene.gravity));
  for (const SceneBody& body : scene.bodies)
    addBody(body, scene.stepper.restSpeed);
}

BulletScene::~BulletScene() {
  for (const auto& body : bodies_)
    world_.removeRigidBody(body.get());
}

void BulletScene::addBody(const SceneBody& body, double restSpeed) {
  const auto* sphere = std::get_if<SphereShape>(&body.shape);
  std::unique_ptr<btRigidBody> rigid =
      sphere != nullptr ? makeSphere(*sphere) : makePlane(std::get<PlaneShape>(body.shape));
  // Bullet multiplies the two restitutions of a pair; Carom takes the geometric mean.
  rigid->setRestitution(toBullet(std::sqrt(body.material.restitution)));
  rigid->setFriction(0);
  rigid->setDamping(0, 0);
  rigid->setSleepingThresholds(toBullet(restSpeed), toBullet(restSpeed));
  world_.addRigidBody(rigid.get());
  bodies_.push_back(std::move(rigid));
}

std::unique_ptr<btRigidBody> BulletScene::makeSphere(const SphereShape& sphere) {
  auto shape = std::make_unique<btSphereShape>(toBullet(sphere.radius));
  btVector3 inertia;
  shape->calculateLocalInertia(toBullet(sphere.mass), inertia);
  btRigidBody::btRigidBodyConstructionInfo info(toBullet(sphere.mass), nullptr, shape.get(),
                                                inertia);
  info.m_startWorldTransform.setOrigin(toBullet(sphere.position));
  auto rigid = std::make_unique<btRigidBody>(info);
  rigid->setLinearVelocity(toBullet(sphere.velocity));
  shapes_.push_back(std::move(shape));
  return rigid;
}

std::unique_ptr<btRigidBody> BulletScene::makePlane(const PlaneShape& plane) {
  auto shape = std::make_unique<btStaticPlaneShape>(toBullet(plane.normal), toBullet(plane.offset));
  const btRigidBody::btRigidBodyConstructionInfo info(0, nullptr, shape.get());
  shapes_.push_back(std::move(shape));
  return std::make_unique<btRigidBody>(info);
}

}  // namespace carom
