#include "scenes/local_reference.h"

#include <algorithm>
#include <cmath>

#include "native/contact_time.h"

namespace carom {
namespace {

Vec3 toVec3(const btVector3& v) {
  return {static_cast<double>(v.x()), static_cast<double>(v.y()), static_cast<double>(v.z())};
}

double inverseMass(const SceneBody& body) {
  const auto* sphere = std::get_if<SphereShape>(&body.shape);
  return sphere == nullptr ? 0.0 : 1.0 / sphere->mass;
}

std::uint64_t pairKey(std::size_t first, std::size_t second) {
  return (static_cast<std::uint64_t>(first) << 32) | second;
}

}  // namespace

LocalReference::LocalReference(const Scene& scene) : scene_(scene), bodies_(scene.bodies.size()) {}

void LocalReference::beforeStep(BulletScene& world) {
  restitutionThreshold_ =
      static_cast<double>(world.world().getSolverInfo().m_restitutionVelocityThreshold);
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    bodies_[i].position = toVec3(world.body(i).getWorldTransform().getOrigin());
    bodies_[i].velocityBefore = toVec3(world.body(i).getLinearVelocity());
  }
}

void LocalReference::afterStep(BulletScene& world, double dt) {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    bodies_[i].velocityAfter = toVec3(world.body(i).getLinearVelocity());
  }
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const auto* sphere = std::get_if<SphereShape>(&scene_.bodies[i].shape);
    if (sphere == nullptr) continue;
    for (std::size_t j = 0; j < bodies_.size(); ++j) {
      const BodyStep& a = bodies_[i];
      const BodyStep& b = bodies_[j];
      PairStep pair{i,
                    j,
                    a.position - b.position,
                    a.velocityBefore - b.velocityBefore,
                    a.velocityAfter - b.velocityAfter,
                    sphere->radius,
                    false};
      if (const auto* other = std::get_if<SphereShape>(&scene_.bodies[j].shape)) {
        if (j <= i) continue;
        pair.reach += other->radius;
      } else {
        const auto& plane = std::get<PlaneShape>(scene_.bodies[j].shape);
        pair.offset = (a.position.dot(plane.normal) - plane.offset) * plane.normal;
        pair.plane = true;
      }
      testPair(pair, dt);
    }
  }
  time_ += dt;
}

void LocalReference::testPair(const PairStep& pair, double dt) {
  // Too far apart to meet within this step, or the next for what Bullet prevents.
  const double speed = pair.velocityBefore.norm() + pair.velocityAfter.norm() +
                       (pair.plane ? scene_.gravity.norm() * dt : 0.0);
  if (pair.offset.norm() > pair.reach + 2.0 * speed * dt) return;

  const bool approachingAfter =
      -pair.velocityAfter.dot(normalAt(pair, pair.velocityAfter, 0.0)) > scene_.stepper.restSpeed;
  const std::uint64_t key = pairKey(pair.first, pair.second);
  if (collided_.contains(key)) {
    if (!approachingAfter) collided_.erase(key);
    return;
  }
  Touch touch;
  if (!findActualTouch(pair, dt, touch) && !findPreventedTouch(pair, dt, touch)) return;
  record(pair, touch);
  if (approachingAfter) collided_.insert(key);
}

// On the path that Bullet took.
bool LocalReference::findActualTouch(const PairStep& pair, double dt, Touch& touch) const {
  const Vec3 start =
      pair.plane ? Vec3(pair.velocityAfter - 0.5 * dt * scene_.gravity) : pair.velocityAfter;
  touch.time = touchTime(pair, start);
  if (touch.time > dt) return false;
  // The velocity at the next node, where Bullet will find the pair, along the normal of the touch.
  touch.nodeSpeed = -pair.velocityAfter.dot(normalAt(pair, start, touch.time));
  touch.approachSpeed = approachAt(pair, start, touch.time);
  return touch.nodeSpeed > scene_.stepper.restSpeed;
}

// On the path that Bullet would have taken, had its solver not acted on a gap.
bool LocalReference::findPreventedTouch(const PairStep& pair, double dt, Touch& touch) const {
  if (!pair.plane || pair.offset.norm() <= pair.reach) return false;
  const Vec3 normal = pair.offset.normalized();
  const Vec3 free = pair.velocityBefore + dt * scene_.gravity;
  const double pushed = (pair.velocityAfter - free).dot(normal);
  if (pushed <= 1e-3 * free.norm()) return false;
  touch.nodeSpeed = -pair.velocityBefore.dot(normal);
  if (touch.nodeSpeed <= scene_.stepper.restSpeed) return false;
  const Vec3 start = pair.velocityBefore + 0.5 * dt * scene_.gravity;
  touch.time = touchTime(pair, start);
  touch.approachSpeed = approachAt(pair, start, touch.time);
  return touch.time < kNever;
}

double LocalReference::touchTime(const PairStep& pair, const Vec3& velocity) const {
  if (!pair.plane) return sphereContactTime(pair.offset, velocity, pair.reach);
  const Vec3& normal = std::get<PlaneShape>(scene_.bodies[pair.second].shape).normal;
  return planeContactTime(pair.offset.dot(normal) - pair.reach, velocity.dot(normal),
                          scene_.gravity.dot(normal));
}

Vec3 LocalReference::normalAt(const PairStep& pair, const Vec3& velocity, double time) const {
  if (pair.plane) return std::get<PlaneShape>(scene_.bodies[pair.second].shape).normal;
  return (pair.offset + time * velocity).normalized();
}

double LocalReference::approachAt(const PairStep& pair, const Vec3& velocity, double time) const {
  const Vec3 then = pair.plane ? Vec3(velocity + time * scene_.gravity) : velocity;
  return -then.dot(normalAt(pair, velocity, time));
}

void LocalReference::record(const PairStep& pair, const Touch& touch) {
  const SceneBody& first = scene_.bodies[pair.first];
  const SceneBody& second = scene_.bodies[pair.second];
  const double restitution =
      touch.nodeSpeed < restitutionThreshold_
          ? 0.0
          : combinedRestitution(first.material.restitution, second.material.restitution);
  const double mass = 1.0 / (inverseMass(first) + inverseMass(second));
  const auto [low, high] = std::minmax(pair.first, pair.second);
  collisions_.push_back({static_cast<BodyId>(low), static_cast<BodyId>(high), time_ + touch.time,
                         (1.0 + restitution) * mass * touch.approachSpeed});
}

}  // namespace carom
