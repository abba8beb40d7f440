#include "scenes/bullet_scene.h"

#include <cassert>
#include <cmath>
#include <cstddef>
#include <mutex>

namespace carom {
namespace {

btScalar toBullet(double value) {
  return static_cast<btScalar>(value);
}
btVector3 toBullet(const Vec3& v) {
  return {toBullet(v.x()), toBullet(v.y()), toBullet(v.z())};
}

/// A body that knows its surface. `table` is null in a scene without restitutions of pairs.
class SurfaceBody : public btRigidBody {
 public:
  SurfaceBody(const btRigidBodyConstructionInfo& info, const SceneBody& body,
              const RestitutionTable* table)
      : btRigidBody(info),
        surface(body.surface),
        restitution(body.material.restitution),
        restitutions(table) {}

  const SurfaceId surface;
  const double restitution;
  const RestitutionTable* const restitutions;
};

/// Our hold on Bullet's slot, which is one for the process; see BulletScene.
struct CombinationSlot {
  std::mutex mutex;
  std::size_t scenes = 0;  // that need it
  CalculateCombinedCallback before = nullptr;
};

CombinationSlot& slot() {
  static CombinationSlot only;
  return only;
}

btScalar combineRestitutions(const btCollisionObject* body, const btCollisionObject* other) {
  const auto* first = dynamic_cast<const SurfaceBody*>(body);
  const auto* second = dynamic_cast<const SurfaceBody*>(other);
  if (first == nullptr || second == nullptr || first->restitutions == nullptr ||
      first->restitutions != second->restitutions) {
    const CalculateCombinedCallback before = slot().before;
    assert(before != nullptr);  // stored before Bullet is given this function
    return before(body, other);
  }
  return toBullet(first->restitutions->of(first->surface, first->restitution, second->surface,
                                          second->restitution));
}

void takeSlot() {
  const std::lock_guard<std::mutex> lock(slot().mutex);
  if (slot().scenes++ > 0) return;
  slot().before = gCalculateCombinedRestitutionCallback;
  gCalculateCombinedRestitutionCallback = combineRestitutions;
}

// What somebody else has put there since stays.
void leaveSlot() {
  const std::lock_guard<std::mutex> lock(slot().mutex);
  if (--slot().scenes > 0) return;
  if (gCalculateCombinedRestitutionCallback == combineRestitutions)
    gCalculateCombinedRestitutionCallback = slot().before;
}

}  // namespace

BulletScene::BulletScene(const Scene& scene) : restitutions_(scene.restitutions) {
  if (!restitutions_.empty()) takeSlot();
  world_.setGravity(toBullet(scene.gravity));
  for (const SceneBody& body : scene.bodies)
    addBody(body, scene.stepper.restSpeed);
}

BulletScene::~BulletScene() {
  for (const auto& body : bodies_)
    world_.removeRigidBody(body.get());
  if (!restitutions_.empty()) leaveSlot();
}

void BulletScene::addBody(const SceneBody& body, double restSpeed) {
  std::unique_ptr<btRigidBody> rigid = makeBody(body);
  // Bullet multiplies the two restitutions of a pair; Carom takes the geometric mean.
  rigid->setRestitution(toBullet(std::sqrt(body.material.restitution)));
  rigid->setFriction(0);
  rigid->setDamping(0, 0);
  rigid->setSleepingThresholds(toBullet(restSpeed), toBullet(restSpeed));
  world_.addRigidBody(rigid.get());
  bodies_.push_back(std::move(rigid));
}

std::unique_ptr<btRigidBody> BulletScene::makeBody(const SceneBody& body) {
  if (const auto* sphere = std::get_if<SphereShape>(&body.shape)) return makeSphere(body, *sphere);
  if (const auto* plane = std::get_if<PlaneShape>(&body.shape)) return makePlane(body, *plane);
  return makeBlock(body, std::get<BlockShape>(body.shape));
}

std::unique_ptr<btRigidBody> BulletScene::makeSphere(const SceneBody& body,
                                                     const SphereShape& sphere) {
  auto shape = std::make_unique<btSphereShape>(toBullet(sphere.radius));
  btVector3 inertia;
  shape->calculateLocalInertia(toBullet(sphere.mass), inertia);
  btRigidBody::btRigidBodyConstructionInfo info(toBullet(sphere.mass), nullptr, shape.get(),
                                                inertia);
  info.m_startWorldTransform.setOrigin(toBullet(sphere.position));
  auto rigid = std::make_unique<SurfaceBody>(info, body, table());
  rigid->setLinearVelocity(toBullet(sphere.velocity));
  shapes_.push_back(std::move(shape));
  return rigid;
}

std::unique_ptr<btRigidBody> BulletScene::makePlane(const SceneBody& body,
                                                    const PlaneShape& plane) {
  auto shape = std::make_unique<btStaticPlaneShape>(toBullet(plane.normal), toBullet(plane.offset));
  const btRigidBody::btRigidBodyConstructionInfo info(0, nullptr, shape.get());
  shapes_.push_back(std::move(shape));
  return std::make_unique<SurfaceBody>(info, body, table());
}

std::unique_ptr<btRigidBody> BulletScene::makeBlock(const SceneBody& body,
                                                    const BlockShape& block) {
  auto shape = std::make_unique<btBoxShape>(toBullet(block.halfExtents));
  shape->setMargin(0);  // Bullet rounds the edges by it
  btRigidBody::btRigidBodyConstructionInfo info(0, nullptr, shape.get());
  const Quat& turn = block.orientation;
  info.m_startWorldTransform = btTransform(
      btQuaternion(toBullet(turn.x()), toBullet(turn.y()), toBullet(turn.z()), toBullet(turn.w())),
      toBullet(block.centre));
  shapes_.push_back(std::move(shape));
  return std::make_unique<SurfaceBody>(info, body, table());
}

}  // namespace carom
