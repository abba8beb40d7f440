#include "bullet_bridge/body_tracker.h"

#include <utility>

namespace carom {
namespace {

int proxyIdOf(const btCollisionObject& object) {
  const btBroadphaseProxy* proxy = object.getBroadphaseHandle();
  return proxy == nullptr ? -1 : proxy->getUid();
}

Vec3 positionOf(const btCollisionObject& object) {
  return toVec3(object.getWorldTransform().getOrigin());
}

}  // namespace

TrackedBody BodyTracker::enter(const btCollisionObject& object) {
  const auto known = indexOf_.find(&object);
  if (known != indexOf_.end() && bodies_[known->second].proxyId == proxyIdOf(object)) {
    return bodies_[known->second];
  }
  TrackedBody body;
  body.object = &object;
  body.proxyId = proxyIdOf(object);
  body.id = nextId_++;
  return body;
}

// Bodies come and go between substeps, and removal reorders the world's array.
void BodyTracker::matchWorld(const btCollisionWorld& world) {
  const auto& objects = world.getCollisionObjectArray();
  const auto count = static_cast<std::size_t>(objects.size());
  bool same = bodies_.size() == count;
  for (std::size_t i = 0; same && i < count; ++i) {
    const btCollisionObject* object = objects[static_cast<int>(i)];
    same = bodies_[i].object == object && bodies_[i].proxyId == proxyIdOf(*object);
  }
  if (same) return;

  std::vector<TrackedBody> matched;
  matched.reserve(count);
  for (std::size_t i = 0; i < count; ++i)
    matched.push_back(enter(*objects[static_cast<int>(i)]));
  bodies_ = std::move(matched);
  indexOf_.clear();
  for (std::size_t i = 0; i < count; ++i)
    indexOf_[bodies_[i].object] = i;
}

void BodyTracker::beginSubstep(const btCollisionWorld& world) {
  matchWorld(world);
  for (TrackedBody& body : bodies_) {
    body.previous = body.current;
    body.current = {};
    body.current.start = positionOf(*body.object);
    const btRigidBody* rigid = btRigidBody::upcast(body.object);
    if (rigid == nullptr) continue;
    body.inverseMass = static_cast<double>(rigid->getInvMass());
    if (rigid->isStaticObject()) continue;
    body.current.velocityBefore = toVec3(rigid->getLinearVelocity());
    if (rigid->isActive()) {
      body.current.acceleration = body.inverseMass * toVec3(rigid->getTotalForce());
    }
  }
}

void BodyTracker::endSubstep(const btCollisionWorld& world) {
  const auto& objects = world.getCollisionObjectArray();
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    TrackedBody& body = bodies_[i];
    const int index = static_cast<int>(i);
    // A callback may have removed bodies since the start: only what is still in place is followed.
    if (index >= objects.size() || objects[index] != body.object) continue;
    const btRigidBody* rigid = btRigidBody::upcast(body.object);
    if (rigid != nullptr && !rigid->isStaticObject()) {
      body.current.velocityAfter = toVec3(rigid->getLinearVelocity());
    }
    body.current.known = true;
  }
}

void BodyTracker::forgetMotion() {
  for (TrackedBody& body : bodies_)
    body.previous = body.current = {};
}

const TrackedBody* BodyTracker::find(const btCollisionObject* object) const {
  const auto found = indexOf_.find(object);
  return found == indexOf_.end() ? nullptr : &bodies_[found->second];
}

}  // namespace carom
