#include "plugin/bullet/world_survey.h"

#include <algorithm>
#include <cmath>

#include <btBulletDynamicsCommon.h>

#include "bullet_bridge/geometry/to_vec3.h"

namespace carom::plugin {

using namespace bullet;

namespace {

/// m: as far as is looked for a floor; and the height of a fall where there is none.
constexpr double kDeepest = 100.0;
constexpr double kUnknownFall = 1.0;
/// m/s: slower bodies lie already.
constexpr double kSlowest = 0.5;

/// Finds the first immovable body on a ray.
struct ImmovableRay final : btCollisionWorld::ClosestRayResultCallback {
  using ClosestRayResultCallback::ClosestRayResultCallback;
  bool needsCollision(btBroadphaseProxy* proxy) const override {
    const auto* const object = static_cast<const btCollisionObject*>(proxy->m_clientObject);
    return object->isStaticObject() && object->hasContactResponse();
  }
};

/// Finds the first other body on a ray.
struct OtherRay final : btCollisionWorld::ClosestRayResultCallback {
  OtherRay(const btCollisionObject& own, const btVector3& from, const btVector3& to)
      : ClosestRayResultCallback(from, to), own_(own) {}
  bool needsCollision(btBroadphaseProxy* proxy) const override {
    const auto* const object = static_cast<const btCollisionObject*>(proxy->m_clientObject);
    return object != &own_ && object->hasContactResponse();
  }

 private:
  const btCollisionObject& own_;
};

btVector3 toBullet(const Vec3& v) {
  return {static_cast<btScalar>(v.x()), static_cast<btScalar>(v.y()), static_cast<btScalar>(v.z())};
}

double freeShareIn(const btDynamicsWorld& world, const Vec3& from, const Vec3& to) {
  ImmovableRay ray(toBullet(from), toBullet(to));
  world.rayTest(ray.m_rayFromWorld, ray.m_rayToWorld, ray);
  return ray.hasHit() ? static_cast<double>(ray.m_closestHitFraction) : 1.0;
}

/// Returns the height of the bottom of a body, along `up`.
double bottomOf(const btCollisionObject& object, const Vec3& up) {
  btVector3 low;
  btVector3 high;
  object.getCollisionShape()->getAabb(object.getWorldTransform(), low, high);
  const Vec3 middle = 0.5 * (toVec3(low) + toVec3(high));
  const Vec3 half = 0.5 * (toVec3(high) - toVec3(low));
  return up.dot(middle) - up.cwiseAbs().dot(half);
}

PlacementBody placementOf(const btCollisionObject& object, double metres) {
  btVector3 centre;
  btScalar radius;
  object.getCollisionShape()->getBoundingSphere(centre, radius);
  return {metres * toVec3(object.getWorldTransform() * centre),
          metres * static_cast<double>(radius)};
}

bool isSolid(const btCollisionObject& object) {
  constexpr int kKinds = btCollisionObject::CO_COLLISION_OBJECT | btCollisionObject::CO_RIGID_BODY |
                         btCollisionObject::CO_FEATHERSTONE_LINK;
  return (object.getInternalType() & kKinds) != 0 && object.getCollisionShape() != nullptr &&
         object.hasContactResponse();
}

double massOf(const btCollisionObject& object) {
  const btRigidBody* const rigid = btRigidBody::upcast(&object);
  if (rigid == nullptr || object.isStaticOrKinematicObject() || !(rigid->getInvMass() > 0))
    return 0.0;
  return 1.0 / static_cast<double>(rigid->getInvMass());
}

}  // namespace

Vec3 upOf(const btDynamicsWorld& world) {
  const Vec3 gravity = toVec3(world.getGravity());
  const double strength = gravity.norm();
  return strength > 0.0 && std::isfinite(strength) ? Vec3(-gravity / strength) : Vec3::UnitY();
}

WorldSurvey surveyOf(const btDynamicsWorld& world, double metres) {
  WorldSurvey survey;
  survey.scene.up = upOf(world);
  const auto& objects = world.getCollisionObjectArray();
  for (int i = 0; i < objects.size(); ++i) {
    const btCollisionObject& object = *objects[i];
    if (!isSolid(object)) continue;
    if (!object.isStaticOrKinematicObject())
      survey.movable.push_back(placementOf(object, metres));
    else if (object.isStaticObject())
      survey.scene.lowest = std::min(survey.scene.lowest.value_or(HUGE_VAL),
                                     metres * bottomOf(object, survey.scene.up));
  }
  survey.scene.freeShare = [&world, metres](const Vec3& from, const Vec3& to) {
    return freeShareIn(world, from / metres, to / metres);
  };
  return survey;
}

std::vector<const btCollisionObject*> heaviestBodies(const btDynamicsWorld& world,
                                                     std::size_t count) {
  std::vector<const btCollisionObject*> bodies;
  const auto& objects = world.getCollisionObjectArray();
  for (int i = 0; i < objects.size(); ++i)
    if (massOf(*objects[i]) > 0.0) bodies.push_back(objects[i]);
  // Equal masses stay in the world's order; a stable sort would take a buffer for that.
  std::ranges::sort(bodies, [](const btCollisionObject* a, const btCollisionObject* b) {
    const double mass = massOf(*a);
    const double other = massOf(*b);
    return mass != other ? mass > other : a->getWorldArrayIndex() < b->getWorldArrayIndex();
  });
  bodies.resize(std::min(bodies.size(), count));
  return bodies;
}

double speedOfLanding(const btDynamicsWorld& world, const btCollisionObject& object,
                      double metres) {
  const Vec3 up = upOf(world);
  const Vec3 centre = placementOf(object, metres).centre;
  const double below = up.dot(centre) - metres * bottomOf(object, up);
  const Vec3 deepest = centre - kDeepest * up;
  OtherRay ray(object, toBullet(centre / metres), toBullet(deepest / metres));
  world.rayTest(ray.m_rayFromWorld, ray.m_rayToWorld, ray);
  const double free = static_cast<double>(ray.m_closestHitFraction) * kDeepest;
  const double fall = ray.hasHit() ? std::max(0.0, free - below) : kUnknownFall;
  const btRigidBody* const rigid = btRigidBody::upcast(&object);
  const double speed = rigid != nullptr ? metres * toVec3(rigid->getLinearVelocity()).norm() : 0.0;
  const double gravity = metres * toVec3(world.getGravity()).norm();
  const double landing = std::sqrt(speed * speed + 2.0 * gravity * fall);
  return landing < kSlowest ? 0.0 : landing;
}

}  // namespace carom::plugin
