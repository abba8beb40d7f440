#include "lab/compare/local_reference.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "native/math/contact_time.h"
#include "native/scheduling/box_contact.h"

namespace carom::lab {

using namespace scenes;

using namespace native;

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

// The path of a sphere relative to another sphere or a block, or above a plane.
struct Path {
  Vec3 offset;
  Vec3 velocity;
  Vec3 acceleration;
  double reach = 0.0;
  const PlaneShape* plane = nullptr;
  const BlockShape* block = nullptr;

  Vec3 offsetAt(double time) const {
    return offset + time * (velocity + (0.5 * time) * acceleration);
  }
  Vec3 inBlock(const Vec3& vector) const { return along(columnsOf(block->orientation), vector); }
  BoxNearest nearestAt(double time) const {
    return nearestOf(block->halfExtents, inBlock(offsetAt(time)));
  }
  Vec3 normalAt(double time) const {
    if (block != nullptr) return block->orientation * nearestAt(time).normal;
    return plane != nullptr ? plane->normal : offsetAt(time).normalized();
  }
  double gapAt(double time) const {
    if (block != nullptr) return nearestAt(time).distance - reach;
    return plane != nullptr ? offsetAt(time).dot(plane->normal) - reach
                            : offsetAt(time).norm() - reach;
  }
  double approachSpeedAt(double time) const {
    return -(velocity + time * acceleration).dot(normalAt(time));
  }
  double touchTime(double limit) const {
    if (plane != nullptr) {
      return planeContactTime(gapAt(0.0), velocity.dot(plane->normal),
                              acceleration.dot(plane->normal));
    }
    if (block != nullptr) {
      return boxContactTime(block->halfExtents,
                            {inBlock(offset), inBlock(velocity), inBlock(acceleration)}, reach,
                            limit);
    }
    if (acceleration.isZero(0.0)) return sphereContactTime(offset, velocity, reach);
    return soughtTime(limit);
  }
  // Finds the contact of a falling sphere with a sleeping one, which has no closed form here: the
  // time is searched in small pieces, then bisected.
  double soughtTime(double limit) const {
    constexpr int kPieces = 1000;
    for (int piece = 1; piece <= kPieces; ++piece) {
      double early = limit * (piece - 1) / kPieces;
      double late = limit * piece / kPieces;
      if (gapAt(late) > 0.0) continue;
      for (int bit = 0; bit < 60; ++bit) {
        const double middle = 0.5 * (early + late);
        (gapAt(middle) > 0.0 ? early : late) = middle;
      }
      return late;
    }
    return kNever;
  }
};

}  // namespace

LocalReference::LocalReference(const Scene& scene) : scene_(scene), bodies_(scene.bodies.size()) {}

void LocalReference::beforeStep(BulletScene& world) {
  restitutionThreshold_ =
      static_cast<double>(world.world().getSolverInfo().m_restitutionVelocityThreshold);
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    bodies_[i].position = toVec3(world.body(i).getWorldTransform().getOrigin());
    bodies_[i].velocityBefore = toVec3(world.body(i).getLinearVelocity());
    bodies_[i].orientation = fromBullet(world.body(i).getWorldTransform().getRotation());
    bodies_[i].spinBefore = toVec3(world.body(i).getAngularVelocity());
    const bool falls = std::holds_alternative<SphereShape>(scene_.bodies[i].shape);
    bodies_[i].acceleration = falls && world.body(i).isActive() ? scene_.gravity : Vec3::Zero();
  }
}

// Finds the pairs that Bullet's solver pushed apart, which only its manifolds tell.
void LocalReference::readPushedPairs(BulletScene& world) {
  pushed_.clear();
  btDispatcher& dispatcher = *world.world().getDispatcher();
  for (int m = 0; m < dispatcher.getNumManifolds(); ++m) {
    const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(m);
    for (int point = 0; point < manifold.getNumContacts(); ++point) {
      if (!isPushed(manifold, manifold.getContactPoint(point))) continue;
      pushed_.insert({manifold.getBody0(), manifold.getBody1()});
      pushed_.insert({manifold.getBody1(), manifold.getBody0()});
    }
  }
}

void LocalReference::afterStep(BulletScene& world, double dt) {
  readPushedPairs(world);
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    bodies_[i].velocityAfter = toVec3(world.body(i).getLinearVelocity());
    bodies_[i].spinAfter = toVec3(world.body(i).getAngularVelocity());
  }
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    if (!std::holds_alternative<SphereShape>(scene_.bodies[i].shape)) continue;
    for (std::size_t j = 0; j < bodies_.size(); ++j) {
      const bool isSphere = std::holds_alternative<SphereShape>(scene_.bodies[j].shape);
      if (!isSphere || j > i) testPair(pairStep(i, j, world), dt);
    }
  }
  time_ += dt;
}

LocalReference::PairStep LocalReference::pairStep(std::size_t sphere, std::size_t other,
                                                  BulletScene& world) const {
  const BodyStep& a = bodies_[sphere];
  const BodyStep& b = bodies_[other];
  PairStep pair;
  pair.first = sphere;
  pair.second = other;
  pair.offset = a.position - b.position;
  pair.velocityBefore = a.velocityBefore - b.velocityBefore;
  pair.velocityAfter = a.velocityAfter - b.velocityAfter;
  pair.acceleration = a.acceleration - b.acceleration;
  pair.reach = std::get<SphereShape>(scene_.bodies[sphere].shape).radius;
  pair.pushed = pushed_.contains({&world.body(sphere), &world.body(other)});
  const auto& shape = scene_.bodies[other].shape;
  pair.plane = std::get_if<PlaneShape>(&shape);
  pair.block = std::get_if<BlockShape>(&shape);
  if (const auto* partner = std::get_if<SphereShape>(&shape)) pair.reach += partner->radius;
  if (pair.plane != nullptr)
    pair.offset = (a.position.dot(pair.plane->normal) - pair.plane->offset) * pair.plane->normal;
  return pair;
}

void LocalReference::testPair(const PairStep& pair, double dt) {
  const std::uint64_t key = pairKey(pair.first, pair.second);
  const Path actual{pair.offset,       pair.velocityAfter - (0.5 * dt) * pair.acceleration,
                    pair.acceleration, pair.reach,
                    pair.plane,        pair.block};
  const double restSpeed = scene_.stepper.restSpeed;
  const bool approaching = -pair.velocityAfter.dot(actual.normalAt(0.0)) > restSpeed;
  const bool collided = collided_.contains(key);
  const double gap = actual.gapAt(0.0);
  const bool passed = gap > 0.0 && -pair.velocityBefore.dot(actual.normalAt(0.0)) <= restSpeed;
  if (collided && (!approaching || passed || gap > pair.reach)) collided_.erase(key);
  // Bullet's solver may still be working on the pair's last collision; but a pair that is apart and
  // was not pushed may collide again.
  if (collided && (gap <= 0.0 || pair.pushed || collided_.contains(key))) return;

  const double farthest = dt * (pair.velocityAfter.norm() + dt * pair.acceleration.norm());
  if (!pair.pushed && actual.gapAt(0.0) > farthest) return;

  const Path free{pair.offset,       pair.velocityBefore + (0.5 * dt) * pair.acceleration,
                  pair.acceleration, pair.reach,
                  pair.plane,        pair.block};
  Touch touch;
  touch.nodeSpeed = -pair.velocityBefore.dot(actual.normalAt(0.0));
  if (actual.gapAt(0.0) <= 0.0) {
    touch.isFree = true;
    touch.approachSpeed = free.approachSpeedAt(0.0);
  } else if (pair.pushed && touch.nodeSpeed > restSpeed) {
    touch.isFree = true;
    touch.time = free.touchTime(4.0 * dt);
    if (touch.time < kNever) touch.approachSpeed = free.approachSpeedAt(touch.time);
  } else {
    touch.time = actual.touchTime(dt);
    if (touch.time > dt) return;
    touch.approachSpeed = actual.approachSpeedAt(touch.time);
    touch.nodeSpeed = -pair.velocityAfter.dot(actual.normalAt(touch.time));
  }
  if (touch.time == kNever || !(touch.nodeSpeed > restSpeed)) return;
  record(pair, touch, dt);
  if (approaching) collided_.insert(key);
}

LocalReference::BodyStep LocalReference::stateAt(std::size_t body, const Touch& touch,
                                                 double dt) const {
  BodyStep state = bodies_[body];
  const double half = touch.isFree ? 0.5 * dt : -0.5 * dt;
  const Vec3 velocity = touch.isFree ? state.velocityBefore : state.velocityAfter;
  const Vec3 start = velocity + half * state.acceleration;
  state.position += touch.time * (start + (0.5 * touch.time) * state.acceleration);
  state.velocityBefore = start + touch.time * state.acceleration;
  if (!touch.isFree) state.spinBefore = state.spinAfter;
  const double rate = state.spinBefore.norm();
  if (rate > 0.0)
    state.orientation =
        Eigen::AngleAxisd(touch.time * rate, state.spinBefore / rate) * state.orientation;
  return state;
}

void LocalReference::record(const PairStep& pair, const Touch& touch, double dt) {
  const SceneBody& first = scene_.bodies[pair.first];
  const SceneBody& second = scene_.bodies[pair.second];
  const double restitution =
      touch.nodeSpeed < restitutionThreshold_ ? 0.0 : restitutionOf(scene_, first, second);
  const double mass = 1.0 / (inverseMass(first) + inverseMass(second));
  const double impulse = (1.0 + restitution) * mass * touch.approachSpeed;
  const auto [low, high] = std::minmax(pair.first, pair.second);
  const double time = time_ + touch.time;
  collisions_.push_back({static_cast<BodyId>(low), static_cast<BodyId>(high), time, impulse});

  const BodyStep sphere = stateAt(pair.first, touch, dt);
  const BodyStep partner = stateAt(pair.second, touch, dt);
  const Path path{sphere.position - partner.position,
                  Vec3::Zero(),
                  Vec3::Zero(),
                  pair.reach,
                  pair.plane,
                  pair.block};
  const double radius = std::get<SphereShape>(first.shape).radius;
  ImpulseEvent event;
  event.time = time;
  event.body = static_cast<BodyId>(pair.first);
  event.other = static_cast<BodyId>(pair.second);
  event.normal = path.normalAt(0.0);
  event.impulse = impulse * event.normal;
  event.position = sphere.position - radius * event.normal;
  event.approachSpeed = touch.approachSpeed;
  event.effectiveMass = mass;
  event.radius = radius;
  if (const auto* other = std::get_if<SphereShape>(&second.shape))
    event.otherRadius = other->radius;
  if (pair.block != nullptr && path.nearestAt(0.0).feature != BoxFeature::face)
    event.otherRadius = 0.0;
  event.bodyPosition = sphere.position;
  event.bodyVelocity = sphere.velocityBefore;
  event.bodyAngularVelocity = sphere.spinBefore;
  event.bodyOrientation = sphere.orientation;
  ImpulseEvent share = event;
  std::swap(share.body, share.other);
  std::swap(share.radius, share.otherRadius);
  share.normal = -event.normal;
  share.impulse = -event.impulse;
  share.bodyPosition = partner.position;
  share.bodyVelocity = partner.velocityBefore;
  share.bodyAngularVelocity = partner.spinBefore;
  share.bodyOrientation = partner.orientation;
  if (pair.block != nullptr) share.bodyOrientation = pair.block->orientation;
  exchangePoses(event, share);
  events_.push_back(event);
  events_.push_back(share);
}

}  // namespace carom::lab
