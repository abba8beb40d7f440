#include "scenes/run/bullet_scene.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>

#include "audio/model/mutex.h"
#include "carom/bullet/world_advice.h"

namespace carom::scenes {
namespace {

/// Rolling and pivoting resistance of a sphere, as the lever arms of the normal force.
struct RollingArms {
  double rolling = 0.0;   // m
  double pivoting = 0.0;  // m
};

/// Bullet multiplies restitutions and frictions of a pair; Carom takes their geometric means.
btScalar factorOf(double coefficient) {
  return toBullet(std::sqrt(coefficient));
}

/// A body that knows its surface. `table` is null in a scene without restitutions of pairs.
class SurfaceBody : public btRigidBody {
 public:
  SurfaceBody(const btRigidBodyConstructionInfo& info, const SceneBody& body,
              const RestitutionTable* table)
      : btRigidBody(info),
        surface(body.surface),
        restitution(body.material.restitution),
        restitutions(table),
        isSolid(scenes::isSolid(body)),
        solidFriction(factorOf(frictionWithSolids(body))) {
    const auto* sphere = std::get_if<SphereShape>(&body.shape);
    if (sphere == nullptr) return;
    isSphere = true;
    // A homogeneous sphere is slowed by 5/7 of the torque over m r.
    arms = {1.4 * body.contact.rollingFriction * sphere->radius, body.contact.pivotingFriction};
  }

  const SurfaceId surface;
  const double restitution;
  const RestitutionTable* const restitutions;
  const bool isSolid;
  const btScalar solidFriction;  // of contacts with solids; Bullet's own friction is that of others
  bool isSphere = false;
  RollingArms arms;
};

constexpr int kCornersOnPlane = 4;  // as many as a contact of Bullet's can have

bool resistsRolling(const SceneBody& body) {
  return body.contact.rollingFriction > 0.0 || body.contact.pivotingFriction > 0.0;
}

bool hasDefaultFriction(const SceneBody& body) {
  return frictionWithSolids(body) != body.contact.friction;
}

/// True if Bullet's own way to combine two bodies' properties does not do for the scene.
bool needsCombination(const Scene& scene) {
  const auto any = [&scene](bool (*is)(const SceneBody&)) {
    return std::ranges::any_of(scene.bodies, is);
  };
  return !scene.restitutions.empty() || any(resistsRolling) ||
         (any(isSolid) && any(hasDefaultFriction));
}

/// Carom's hold on Bullet's callback slots, of which the process has one set; see BulletScene.
struct CombinationSlots {
  audio::Mutex mutex;
  std::size_t scenes = 0;                           // number of scenes that need the slots
  CalculateCombinedCallback restitution = nullptr;  // the functions installed before
  CalculateCombinedCallback friction = nullptr;
  CalculateCombinedCallback rolling = nullptr;
  CalculateCombinedCallback spinning = nullptr;
};

CombinationSlots& slots() {
  static CombinationSlots only;
  return only;
}

btScalar combineRestitutions(const btCollisionObject* body, const btCollisionObject* other) {
  const auto* first = dynamic_cast<const SurfaceBody*>(body);
  const auto* second = dynamic_cast<const SurfaceBody*>(other);
  if (first == nullptr || second == nullptr || first->restitutions == nullptr ||
      first->restitutions != second->restitutions) {
    const CalculateCombinedCallback before = slots().restitution;
    assert(before != nullptr);  // stored before Bullet is given this function
    return before(body, other);
  }
  return toBullet(first->restitutions->of(first->surface, first->restitution, second->surface,
                                          second->restitution));
}

/// Returns the friction of two bodies of which one is a solid: see frictionWithSolids.
btScalar combineFrictions(const btCollisionObject* body, const btCollisionObject* other) {
  const auto* first = dynamic_cast<const SurfaceBody*>(body);
  const auto* second = dynamic_cast<const SurfaceBody*>(other);
  if (first == nullptr || second == nullptr || !(first->isSolid || second->isSolid)) {
    const CalculateCombinedCallback before = slots().friction;
    assert(before != nullptr);  // stored before Bullet is given this function
    return before(body, other);
  }
  return first->solidFriction * second->solidFriction;
}

/// Returns the arm of the sphere in a contact of a sphere and another kind of body, and 0 for other
/// pairs: the native stepper knows no other rolling resistance.
btScalar combineArms(const btCollisionObject* body, const btCollisionObject* other,
                     double RollingArms::*arm, CalculateCombinedCallback before) {
  const auto* first = dynamic_cast<const SurfaceBody*>(body);
  const auto* second = dynamic_cast<const SurfaceBody*>(other);
  if (first == nullptr || second == nullptr) {
    assert(before != nullptr);  // stored before Bullet is given this function
    return before(body, other);
  }
  if (first->isSphere == second->isSphere) return 0;
  return toBullet((first->isSphere ? first : second)->arms.*arm);
}

btScalar combineRolling(const btCollisionObject* body, const btCollisionObject* other) {
  return combineArms(body, other, &RollingArms::rolling, slots().rolling);
}

btScalar combineSpinning(const btCollisionObject* body, const btCollisionObject* other) {
  return combineArms(body, other, &RollingArms::pivoting, slots().spinning);
}

/// Remembers the function in `slot` and installs `ours` in its place.
void take(CalculateCombinedCallback& slot, CalculateCombinedCallback ours,
          CalculateCombinedCallback& before) {
  before = slot;
  slot = ours;
}

void takeSlots() {
  const audio::MutexLock lock(slots().mutex);
  if (slots().scenes++ > 0) return;
  take(gCalculateCombinedRestitutionCallback, combineRestitutions, slots().restitution);
  take(gCalculateCombinedFrictionCallback, combineFrictions, slots().friction);
  take(gCalculateCombinedRollingFrictionCallback, combineRolling, slots().rolling);
  take(gCalculateCombinedSpinningFrictionCallback, combineSpinning, slots().spinning);
}

// Restores `slot`, unless other code has replaced `ours` since.
void give(CalculateCombinedCallback& slot, CalculateCombinedCallback ours,
          CalculateCombinedCallback before) {
  if (slot == ours) slot = before;
}

void leaveSlots() {
  const audio::MutexLock lock(slots().mutex);
  if (--slots().scenes > 0) return;
  give(gCalculateCombinedRestitutionCallback, combineRestitutions, slots().restitution);
  give(gCalculateCombinedFrictionCallback, combineFrictions, slots().friction);
  give(gCalculateCombinedRollingFrictionCallback, combineRolling, slots().rolling);
  give(gCalculateCombinedSpinningFrictionCallback, combineSpinning, slots().spinning);
}

}  // namespace

BulletScene::BulletScene(const Scene& scene)
    : restitutions_(scene.restitutions), needsSlots_(needsCombination(scene)) {
  if (needsSlots_) takeSlots();
  world_.setGravity(toBullet(scene.gravity));
  const bool hasSolids = std::ranges::any_of(scene.bodies, isSolid);
  if (hasSolids) prepareForSolids();
  for (const SceneBody& body : scene.bodies)
    addBody(body, scene.stepper.restSpeed);
  if (!hasSolids && !scene.stepper.tuned) return;
  [[maybe_unused]] const Result<Tuning> tuned = tune(world_, scene.stepper.step);
  assert(tuned);  // the step has been checked
}

BulletScene::~BulletScene() {
  for (const auto& body : bodies_)
    world_.removeRigidBody(body.get());
  if (needsSlots_) leaveSlots();
}

/// Makes the world separate polyhedra by their faces and edges (see BulletSolid), and gives their
/// contact with a plane more than one corner in a step: on one corner at a time they rattle and do
/// not rest. Neither setting affects spheres.
void BulletScene::prepareForSolids() {
  world_.getDispatchInfo().m_enableSatConvex = true;
  configuration_.setPlaneConvexMultipointIterations(kCornersOnPlane, kCornersOnPlane);
}

Quat BulletScene::orientation(std::size_t index, const Quat& bullet) const {
  return bullet * frames_[index].conjugate();
}

void BulletScene::addBody(const SceneBody& body, double restSpeed) {
  frames_.push_back(Quat::Identity());  // makeBody replaces it for solids
  std::unique_ptr<btRigidBody> rigid = makeBody(body);
  rigid->setRestitution(factorOf(body.material.restitution));
  rigid->setFriction(factorOf(body.contact.friction));
  rigid->setDamping(0, 0);
  rigid->setSleepingThresholds(toBullet(restSpeed), toBullet(restSpeed));
  world_.addRigidBody(rigid.get());
  bodies_.push_back(std::move(rigid));
}

std::unique_ptr<btRigidBody> BulletScene::makeBody(const SceneBody& body) {
  if (const auto* sphere = std::get_if<SphereShape>(&body.shape)) return makeSphere(body, *sphere);
  if (const auto* plane = std::get_if<PlaneShape>(&body.shape)) return makePlane(body, *plane);
  if (const auto* solid = std::get_if<SolidShape>(&body.shape)) return makeSolid(body, *solid);
  return makeBlock(body, std::get<BlockShape>(body.shape));
}

std::unique_ptr<btRigidBody> BulletScene::makeSphere(const SceneBody& body,
                                                     const SphereShape& sphere) {
  auto shape = std::make_unique<btSphereShape>(toBullet(sphere.radius));
  btVector3 inertia;
  shape->calculateLocalInertia(toBullet(sphere.mass), inertia);
  btRigidBody::btRigidBodyConstructionInfo info(toBullet(sphere.mass), nullptr, shape.get(),
                                                inertia);
  info.m_startWorldTransform = toBullet(sphere.orientation, sphere.position);
  auto rigid = std::make_unique<SurfaceBody>(info, body, table());
  rigid->setLinearVelocity(toBullet(sphere.velocity));
  rigid->setAngularVelocity(toBullet(sphere.spin));
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
  if (world_.getDispatchInfo().m_enableSatConvex) shape->initializePolyhedralFeatures();
  btRigidBody::btRigidBodyConstructionInfo info(0, nullptr, shape.get());
  info.m_startWorldTransform = toBullet(block.orientation, block.centre);
  shapes_.push_back(std::move(shape));
  return std::make_unique<SurfaceBody>(info, body, table());
}

std::unique_ptr<btRigidBody> BulletScene::makeSolid(const SceneBody& body,
                                                    const SolidShape& solid) {
  PrincipalAxes axes;
  if (solid.canMove()) axes = principalAxes(solid.inertia);
  frames_.back() = axes.toBody;
  hasTurnedFrames_ = hasTurnedFrames_ || !axes.toBody.isApprox(Quat::Identity(), 0.0);
  const BulletSolid& made = solids_.emplace_back(solid, axes.toBody);
  const btScalar mass = solid.canMove() ? toBullet(solid.mass) : btScalar(0);
  btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, &made.shape(),
                                                toBullet(axes.inertia));
  info.m_startWorldTransform = toBullet(solid.orientation * axes.toBody, solid.position);
  auto rigid = std::make_unique<SurfaceBody>(info, body, table());
  if (!solid.canMove()) return rigid;
  rigid->setLinearVelocity(toBullet(solid.velocity));
  rigid->setAngularVelocity(toBullet(solid.spin));
  return rigid;
}

std::pair<std::string, std::string> overlapAtStart(const Scene& scene, double depth) {
  BulletScene bullet(scene);
  bullet.world().performDiscreteCollisionDetection();
  const auto radiusOf = [](const btCollisionObject& body) {
    btVector3 centre;
    btScalar radius = 0;
    body.getCollisionShape()->getBoundingSphere(centre, radius);
    return static_cast<double>(radius);
  };
  const auto nameOf = [&](const btCollisionObject* wanted) {
    for (std::size_t index = 0; index < scene.bodies.size(); ++index)
      if (&bullet.body(index) == wanted) return scene.bodies[index].name;
    return std::string("a body");
  };
  btDispatcher& dispatcher = *bullet.world().getDispatcher();
  for (int at = 0; at < dispatcher.getNumManifolds(); ++at) {
    const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(at);
    const btCollisionObject& one = *manifold.getBody0();
    const btCollisionObject& other = *manifold.getBody1();
    const double allowed = depth * std::min(radiusOf(one), radiusOf(other));
    for (int point = 0; point < manifold.getNumContacts(); ++point)
      if (static_cast<double>(manifold.getContactPoint(point).getDistance()) < -allowed)
        return {nameOf(&one), nameOf(&other)};
  }
  return {};
}

}  // namespace carom::scenes
