#include "lab/compare/contact_poller.h"

#include <algorithm>
#include <cmath>

namespace carom::lab {

using namespace scenes;
namespace {

std::pair<BodyId, BodyId> ordered(BodyId a, BodyId b) {
  return {std::min(a, b), std::max(a, b)};
}

}  // namespace

ContactPoller::ContactPoller(BulletScene& world) : world_(world) {
  const auto count = static_cast<std::size_t>(world_.world().getNumCollisionObjects());
  before_.resize(count);
  for (std::size_t index = 0; index < count; ++index)
    ids_[&world_.body(index)] = static_cast<BodyId>(index);
}

void ContactPoller::beforeStep() {
  for (std::size_t index = 0; index < before_.size(); ++index) {
    const btRigidBody& body = world_.body(index);
    before_[index] = {body.getCenterOfMassPosition(), body.getLinearVelocity(),
                      body.getAngularVelocity()};
  }
}

btVector3 ContactPoller::velocityAt(BodyId body, const btVector3& point) const {
  const Motion& motion = before_[body];
  return motion.velocity + motion.spin.cross(point - motion.position);
}

void ContactPoller::afterStep(double dt) {
  const double start = time_;
  time_ += dt;
  btDispatcher& dispatcher = *world_.world().getDispatcher();
  for (int m = 0; m < dispatcher.getNumManifolds(); ++m) {
    const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(m);
    const BodyId first = ids_.at(manifold.getBody0());
    const BodyId second = ids_.at(manifold.getBody1());
    for (int index = 0; index < manifold.getNumContacts(); ++index) {
      const btManifoldPoint& point = manifold.getContactPoint(index);
      if (!isPushed(manifold, point)) continue;
      double& last = pushed_.try_emplace(ordered(first, second), -1.0).first->second;
      // A pair that was pushed in the step before is still in the same contact.
      const bool isNew = last < start - 0.5 * dt;
      last = time_;
      if (!isNew) continue;
      const btVector3 relative = velocityAt(first, point.getPositionWorldOnA()) -
                                 velocityAt(second, point.getPositionWorldOnB());
      const auto approach = -static_cast<double>(relative.dot(point.m_normalWorldOnB));
      PolledContact contact = {time_, time_};
      // Bullet measured the distance at the poses that the step began with.
      if (approach > 0.0)
        contact.backDated = start + static_cast<double>(point.getDistance()) / approach;
      seen_[ordered(first, second)].push_back(contact);
    }
  }
}

std::optional<PolledContact> ContactPoller::nearest(BodyId body, BodyId other, double time,
                                                    double window) const {
  const auto pair = seen_.find(ordered(body, other));
  if (pair == seen_.end()) return std::nullopt;
  const auto best = std::ranges::min_element(
      pair->second, {},
      [time](const PolledContact& contact) { return std::abs(contact.seen - time); });
  if (std::abs(best->seen - time) > window) return std::nullopt;
  return *best;
}

}  // namespace carom::lab
