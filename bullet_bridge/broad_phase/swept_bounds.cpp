#include "bullet_bridge/broad_phase/swept_bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace carom::bullet {
namespace {

// Doubles become floats with a relative error of 2^-24.
constexpr float kOutwards = std::numeric_limits<float>::epsilon();

float roundedDown(double value) {
  const auto nearest = static_cast<float>(value);
  return nearest - kOutwards * std::abs(nearest);
}

float roundedUp(double value) {
  const auto nearest = static_cast<float>(value);
  return nearest + kOutwards * std::abs(nearest);
}

// Range (m, along one axis) over which the centre of a body leaves its start during the substep.
struct Travel {
  double low = 0.0;
  double high = 0.0;
};

// Between its ends a parabola leaves their range by up to a dt^2 / 8. Bullet's solver acts on gaps
// that approach and rebound together, at most twice the approach, would close.
Travel travelOf(const SubstepMotion& motion, Eigen::Index axis, double dt, bool speculative) {
  const double bulge = 0.125 * dt * dt * std::abs(motion.acceleration[axis]);
  const double went = dt * motion.velocityAfter[axis];
  Travel travel{std::min(0.0, went) - bulge, std::max(0.0, went) + bulge};
  if (speculative) {
    const double would = 2.0 * dt * (motion.velocityBefore[axis] + dt * motion.acceleration[axis]);
    travel.low = std::min(travel.low, would);
    travel.high = std::max(travel.high, would);
  }
  return travel;
}

// Reads the extent (m) of a body around its centre at the start of the substep, for any rotation
// meanwhile.
void readExtent(const TrackedBody& body, double dt, Vec3& low, Vec3& high) {
  const bool lags = body.kind == BodyKind::kinematic && !body.current.angularAfter.isZero(0.0);
  if (body.shape == ContactShape::sphere || lags) {
    low.setConstant(-body.radius);
    high.setConstant(body.radius);
    return;
  }
  btTransform pose = body.object->getWorldTransform();  // pose at the end: the body has turned
  pose.setOrigin(btVector3(0, 0, 0));
  btVector3 least;
  btVector3 most;
  body.object->getCollisionShape()->getAabb(pose, least, most);
  const double turn =
      dt * std::max(body.current.angularBefore.norm(), body.current.angularAfter.norm());
  const double bulge = body.radius * std::min(2.0 * turn, 2.0);
  low = toVec3(least).array() - bulge;
  high = toVec3(most).array() + bulge;
}

// Bullet puts a kinematic body at the end of its path at once, and lets it collide there.
void addPlace(const TrackedBody& body, SweptBox& box) {
  const Vec3 place = toVec3(body.object->getWorldTransform().getOrigin());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double centre = place[static_cast<Eigen::Index>(axis)];
    box.low[axis] = std::min(box.low[axis], roundedDown(centre - body.radius));
    box.high[axis] = std::max(box.high[axis], roundedUp(centre + body.radius));
  }
}

}  // namespace

SweptBox boxAtRest(const TrackedBody& body) {
  const btBroadphaseProxy& proxy = *body.object->getBroadphaseHandle();
  const Vec3 low = toVec3(proxy.m_aabbMin);
  const Vec3 high = toVec3(proxy.m_aabbMax);
  SweptBox box;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box.low[axis] = roundedDown(low[static_cast<Eigen::Index>(axis)] - body.margin);
    box.high[axis] = roundedUp(high[static_cast<Eigen::Index>(axis)] + body.margin);
  }
  return box;
}

SweptBox sweptBox(const TrackedBody& body, double dt, bool speculative) {
  SweptBox box;
  box.active = body.awake;
  Vec3 low;
  Vec3 high;
  readExtent(body, dt, low, high);
  if (speculative) {
    // Bullet holds contacts over this gap, and its friction may act on them without load.
    low.array() -= body.margin;
    high.array() += body.margin;
  }
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Travel travel = travelOf(body.current, axis, dt, speculative);
    const double start = body.current.start[axis];
    box.low[static_cast<std::size_t>(axis)] = roundedDown(start + low[axis] + travel.low);
    box.high[static_cast<std::size_t>(axis)] = roundedUp(start + high[axis] + travel.high);
  }
  if (body.kind == BodyKind::kinematic && body.awake) addPlace(body, box);
  return box;
}

}  // namespace carom::bullet
