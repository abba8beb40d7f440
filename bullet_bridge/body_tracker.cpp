#include "bullet_bridge/body_tracker.h"

#include <unordered_map>
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

void readShape(TrackedBody& body) {
  const btCollisionShape& shape = *body.object->getCollisionShape();
  if (shape.getShapeType() == SPHERE_SHAPE_PROXYTYPE) {
    body.shape = ContactShape::sphere;
    body.radius = static_cast<double>(static_cast<const btSphereShape&>(shape).getRadius());
  } else if (shape.getShapeType() == STATIC_PLANE_PROXYTYPE) {
    const auto& plane = static_cast<const btStaticPlaneShape&>(shape);
    const btTransform& pose = body.object->getWorldTransform();
    body.shape = ContactShape::plane;
    body.planeNormal = toVec3(pose.getBasis() * plane.getPlaneNormal()).normalized();
    body.planeOffset = static_cast<double>(plane.getPlaneConstant()) +
                       body.planeNormal.dot(toVec3(pose.getOrigin()));
  } else {
    body.shape = ContactShape::other;
  }
}

}  // namespace

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

  std::unordered_map<const btCollisionObject*, const TrackedBody*> known;
  for (const TrackedBody& body : bodies_)
    known[body.object] = &body;
  std::vector<TrackedBody> matched(count);
  for (std::size_t i = 0; i < count; ++i) {
    const btCollisionObject* object = objects[static_cast<int>(i)];
    const auto found = known.find(object);
    if (found != known.end() && found->second->proxyId == proxyIdOf(*object)) {
      matched[i] = *found->second;
    } else {
      matched[i].object = object;
      matched[i].proxyId = proxyIdOf(*object);
      matched[i].id = nextId_++;
    }
  }
  bodies_ = std::move(matched);
  indexOf_.clear();
  for (std::size_t i = 0; i < count; ++i)
    indexOf_[bodies_[i].id] = i;
}

void BodyTracker::beginSubstep(const btCollisionWorld& world) {
  matchWorld(world);
  for (TrackedBody& body : bodies_) {
    body.current = {};
    body.current.start = positionOf(*body.object);
    readShape(body);
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

const TrackedBody* BodyTracker::find(const btCollisionObject& object) const {
  const auto index = static_cast<std::size_t>(object.getWorldArrayIndex());  // -1: in no world
  return index < bodies_.size() && bodies_[index].object == &object ? &bodies_[index] : nullptr;
}

const TrackedBody* BodyTracker::find(BodyId id) const {
  const auto found = indexOf_.find(id);
  return found == indexOf_.end() ? nullptr : &bodies_[found->second];
}

}  // namespace carom
