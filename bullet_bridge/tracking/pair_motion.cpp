#include "bullet_bridge/tracking/pair_motion.h"

#include <limits>

#include "bullet_bridge/geometry/impact_time.h"

namespace carom::bullet {
namespace {

RigidMotion motionOf(const TrackedBody& body, MotionKind kind, double dt) {
  return kind == MotionKind::actual ? body.actual(dt) : body.contactFree(dt);
}

// Leaves out the orientation, which is costly for a sphere and does not affect its gap.
RigidMotion unturned(const TrackedBody& body, MotionKind kind, double dt) {
  const SubstepMotion& motion = body.current;
  RigidMotion result;
  result.centre = kind == MotionKind::actual ? motion.actual(dt) : motion.contactFree(dt);
  result.angularVelocity = kind == MotionKind::actual ? motion.angularAfter : motion.angularBefore;
  return result;
}

}  // namespace

PairMotion::PairMotion(const ContactPair& pair, MotionKind kind, double dt, double horizon,
                       ShapePair& pieces)
    : pair_(pair), pieces_(&pieces) {
  if (pair.isClosedForm()) {
    body_ = unturned(*pair.body, kind, dt);
    other_ = unturned(*pair.other, kind, dt);
    return;
  }
  body_ = motionOf(*pair.body, kind, dt);
  other_ = motionOf(*pair.other, kind, dt);
  const double reach = std::max(pair.body->margin, pair.other->margin);
  followed_ = pieces.set({pair.body->object->getCollisionShape(), body_, pair.body->parts.get()},
                         {pair.other->object->getCollisionShape(), other_, pair.other->parts.get()},
                         horizon, reach);
}

double PairMotion::height(double s) const {
  const TrackedBody& plane = *pair_.other;
  return (body_.centre.positionAt(s) - other_.centre.positionAt(s)).dot(plane.planeNormal) -
         (plane.planeOffset - plane.current.start.dot(plane.planeNormal)) - pair_.body->radius;
}

Proximity PairMotion::proximityAt(double s) const {
  if (!pair_.isClosedForm()) return pieces_->proximityAt(s);
  const Vec3 centre = body_.centre.positionAt(s);
  Proximity near;
  if (pair_.isOnPlane()) {
    near.normal = pair_.other->planeNormal;
    near.gap = height(s);
  } else {
    const Vec3 apart = centre - other_.centre.positionAt(s);
    const double distance = apart.norm();
    near.normal = distance > 0.0 ? Vec3(apart / distance) : Vec3::UnitX();
    near.gap = distance - reach();
  }
  near.point = centre - pair_.body->radius * near.normal;
  near.otherPoint = near.point - near.gap * near.normal;
  return near;
}

double PairMotion::radiusAt(PairSide side, double s, const Proximity& closest) const {
  if (!pair_.isClosedForm()) return pieces_->localShape(side, s, closest).radius;
  return side == PairSide::other && pair_.isOnPlane() ? std::numeric_limits<double>::infinity()
                                                      : trackedOf(side).radius;
}

LocalShape PairMotion::shapeAt(PairSide side, const Proximity& closest) const {
  if (!pair_.isClosedForm()) return pieces_->localShape(side, 0.0, closest);
  const double radius = radiusAt(side, 0.0, closest);
  return {.radius = radius, .rollingRadius = radius};
}

double PairMotion::impactTime(double horizon) const {
  if (!pair_.isClosedForm()) return pieces_->impactTime();
  const Motion relative = body_.centre - other_.centre;
  if (!pair_.isOnPlane()) return sphereImpactTime(relative, reach(), horizon);
  const Vec3& normal = pair_.other->planeNormal;
  return planeImpactTime(height(0.0), relative.velocity.dot(normal),
                         relative.acceleration.dot(normal), horizon);
}

}  // namespace carom::bullet
