#include "bullet_bridge/tracking/solved_contact.h"

#include <algorithm>

#include <BulletSoftBody/btSoftBody.h>

namespace carom::bullet {
namespace {

constexpr double kUnknown = -1.0;  // no restitution is negative
constexpr double kNothing = -1.0;  // as ContactReader::impulseOf

btBroadphaseProxy* proxyOf(const btCollisionObject& object) {
  return const_cast<btBroadphaseProxy*>(object.getBroadphaseHandle());  // not const in Bullet
}

// The manifolds of Bullet's continuous detection are in none of its pairs, and protected; a pointer
// to member through a derived class is the legal way to them.
struct PredictedAccess : btDiscreteDynamicsWorld {
  static const btAlignedObjectArray<btPersistentManifold*>& of(btDiscreteDynamicsWorld& world) {
    return world.*(&PredictedAccess::m_predictiveManifolds);
  }
};

// Friction impulse (N s, world frame) along the directions that the solver chose, on the manifold's
// first body.
Vec3 frictionOf(const btManifoldPoint& point) {
  Vec3 friction = Vec3::Zero();
  const auto add = [&friction](btScalar impulse, const btVector3& direction) {
    if (impulse != 0) friction += static_cast<double>(impulse) * toVec3(direction);
  };
  add(point.m_appliedImpulseLateral1, point.m_lateralFrictionDir1);
  add(point.m_appliedImpulseLateral2, point.m_lateralFrictionDir2);  // direction unset if 0
  return friction;
}

// True if Bullet's solver has applied an impulse at a point, or friction alone.
bool isPushed(const btPersistentManifold& manifold) {
  for (int i = 0; i < manifold.getNumContacts(); ++i) {
    const btManifoldPoint& point = manifold.getContactPoint(i);
    if (point.getDistance() > manifold.getContactProcessingThreshold()) continue;
    if (point.getAppliedImpulse() != 0 || point.m_appliedImpulseLateral1 != 0 ||
        point.m_appliedImpulseLateral2 != 0)
      return true;
  }
  return false;
}

bool isBetween(const btPersistentManifold& manifold, const btCollisionObject* first,
               const btCollisionObject* second) {
  return (manifold.getBody0() == first && manifold.getBody1() == second) ||
         (manifold.getBody0() == second && manifold.getBody1() == first);
}

}  // namespace

double combinedRestitution(const ContactPair& pair) {
  // Bullet itself calls this callback; a host may have put its own there.
  return static_cast<double>(
      gCalculateCombinedRestitutionCallback(pair.body->object, pair.other->object));
}

void ContactReader::beginReading(bool continuous) {
  predicted_.clear();
  latest_ = {};
  auto* discrete = continuous ? dynamic_cast<btDiscreteDynamicsWorld*>(&world_) : nullptr;
  if (discrete == nullptr) return;
  const auto& manifolds = PredictedAccess::of(*discrete);
  for (int i = 0; i < manifolds.size(); ++i)
    predicted_.push_back(manifolds[i]);
}

bool ContactReader::collides(const ContactPair& pair) const {
  btDispatcher& dispatcher = *world_.getDispatcher();
  const btCollisionObject& body = *pair.body->object;
  const btCollisionObject& other = *pair.other->object;
  return dispatcher.needsResponse(&body, &other) && dispatcher.needsCollision(&body, &other) &&
         world_.getPairCache()->needsBroadphaseCollision(proxyOf(body), proxyOf(other));
}

const SolvedContact& ContactReader::read(const ContactPair& pair) {
  if (pair.body == latest_.body && pair.other == latest_.other) return contact_;
  latest_ = pair;
  contact_.restitution = kUnknown;
  contact_.impulse = 0.0;
  contact_.applied = Vec3::Zero();
  contact_.points.clear();
  gatherManifolds(pair);
  for (int i = 0; i < manifolds_.size(); ++i)
    addManifold(pair, *manifolds_[i], false);
  for (const btPersistentManifold* manifold : predicted_) {
    if (isBetween(*manifold, pair.body->object, pair.other->object))
      addManifold(pair, *manifold, true);
  }
  if (contact_.restitution == kUnknown) {
    // The pair is not detected yet, or only predicted: it will bounce as Bullet sets its points up.
    contact_.restitution = combinedRestitution(pair);
  }
  return contact_;
}

std::span<const ContactPair> ContactReader::pushedPairs(BodyTracker& tracker) {
  pushed_.clear();
  btDispatcher& dispatcher = *world_.getDispatcher();
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
    if (manifold.getNumContacts() == 0) continue;
    addPushed(manifold, tracker.find(*manifold.getBody0()), tracker.find(*manifold.getBody1()));
  }
  // A body that Bullet predicted a contact for may be gone since.
  const auto isOf = [&](const btCollisionObject* object) {
    const auto found = std::ranges::find(tracker.bodies(), object, &TrackedBody::object);
    return found == tracker.bodies().end() ? nullptr : &*found;
  };
  for (const btPersistentManifold* manifold : predicted_) {
    addPushed(*manifold, isOf(manifold->getBody0()), isOf(manifold->getBody1()));
  }
  std::ranges::sort(pushed_, {}, &Pushed::key);
  const auto isSame = [](const Pushed& one, const Pushed& other) { return one.key == other.key; };
  pushed_.erase(std::unique(pushed_.begin(), pushed_.end(), isSame), pushed_.end());
  pairs_.clear();
  for (const Pushed& pushed : pushed_) {
    tracker.complete(*pushed.pair.body);
    tracker.complete(*pushed.pair.other);
    pairs_.push_back(pushed.pair);
  }
  return pairs_;
}

// Adds the pair of a manifold that the solver has acted on. The pair's `body` does not depend on
// the order in which the manifold has the two.
void ContactReader::addPushed(const btPersistentManifold& manifold, const TrackedBody* first,
                              const TrackedBody* second) {
  if (first == nullptr || second == nullptr || (first->rests && second->rests)) return;
  if (!(first->awake || second->awake) || !isPushed(manifold)) return;
  for (const TrackedBody* body : {first, second}) {
    if (!body->current.known || body->shape == ContactShape::none) return;
  }
  const auto [low, high] = std::minmax(first, second);
  const ContactPair pair = ContactPair::of(*low, *high);
  pushed_.push_back({pair.key(), pair});
}

std::uint64_t ContactReader::softContacts() const {
  int count = 0;
  const auto& objects = world_.getCollisionObjectArray();
  for (int i = 0; i < objects.size(); ++i) {
    if (objects[i]->getInternalType() != btCollisionObject::CO_SOFT_BODY) continue;
    const auto& soft = static_cast<const btSoftBody&>(*objects[i]);
    count += soft.m_rcontacts.size() + soft.m_scontacts.size();
  }
  return static_cast<std::uint64_t>(count);
}

void ContactReader::gatherManifolds(const ContactPair& pair) {
  manifolds_.resize(0);
  const btBroadphasePair* entry =
      world_.getPairCache()->findPair(proxyOf(*pair.body->object), proxyOf(*pair.other->object));
  if (entry != nullptr && entry->m_algorithm != nullptr)
    entry->m_algorithm->getAllContactManifolds(manifolds_);
}

double ContactReader::impulseOf(const ContactPair& pair) {
  if (!predicted_.empty()) {
    const SolvedContact& solved = read(pair);
    return solved.applied.isZero(0.0) ? kNothing : solved.impulse;
  }
  if (!pair.body->awake && !pair.other->awake) return kNothing;
  gatherManifolds(pair);
  double impulse = 0.0;
  bool isPushed = false;
  for (int i = 0; i < manifolds_.size(); ++i) {
    const btPersistentManifold& manifold = *manifolds_[i];
    for (int j = 0; j < manifold.getNumContacts(); ++j) {
      const btManifoldPoint& point = manifold.getContactPoint(j);
      if (point.getDistance() > manifold.getContactProcessingThreshold()) continue;
      impulse += static_cast<double>(point.getAppliedImpulse());
      isPushed = isPushed || point.getAppliedImpulse() != 0 ||
                 point.m_appliedImpulseLateral1 != 0 || point.m_appliedImpulseLateral2 != 0;
    }
  }
  return isPushed ? impulse : kNothing;
}

void ContactReader::addManifold(const ContactPair& pair, const btPersistentManifold& manifold,
                                bool predicted) {
  const double sign = manifold.getBody0() == pair.body->object ? 1.0 : -1.0;
  const bool awake = pair.body->awake || pair.other->awake;
  for (int i = 0; i < manifold.getNumContacts(); ++i) {
    const btManifoldPoint& point = manifold.getContactPoint(i);
    const bool solved = awake && point.getDistance() <= manifold.getContactProcessingThreshold();
    if (!predicted) {  // predicted points hold no restitution
      contact_.restitution =
          std::max(contact_.restitution, static_cast<double>(point.m_combinedRestitution));
    }
    addPoint(point, sign, solved);
  }
}

void ContactReader::addPoint(const btManifoldPoint& point, double sign, bool solved) {
  SolvedPoint added;
  added.position = toVec3(sign > 0.0 ? point.getPositionWorldOnB() : point.getPositionWorldOnA());
  added.normal = sign * toVec3(point.m_normalWorldOnB);
  added.gap = static_cast<double>(point.getDistance());
  if (solved) {
    added.impulse = static_cast<double>(point.getAppliedImpulse());
    contact_.impulse += added.impulse;
    contact_.applied += added.impulse * added.normal;
    contact_.applied += sign * frictionOf(point);
  }
  contact_.points.push_back(added);
}

}  // namespace carom::bullet
