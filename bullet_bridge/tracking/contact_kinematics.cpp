#include "bullet_bridge/tracking/contact_kinematics.h"

#include <cmath>
#include <limits>

namespace carom::bullet {
namespace {

/// Largest angle (rad) that a contact point may move along a rim in a step; at tilt a, that of a
/// coin moves at sqrt(4 g / (R sin a)) (Euler's disk: Moffatt 2000, Nature 404, 833).
constexpr double kFarthestTurn = 0.5;
constexpr double kWeight = 10.0;  // m/s^2, gravity

// Returns the contact as one point of both bodies: the mean of the points, weighted by load, or
// without load the nearest point of the other.
Proximity meanContact(const Proximity& start, const SolvedContact& solved) {
  Vec3 position = Vec3::Zero();
  Vec3 normal = Vec3::Zero();
  double sum = 0.0;
  for (const SolvedPoint& point : solved.points) {
    position += point.impulse * point.position;
    normal += point.impulse * point.normal;
    sum += point.impulse;
  }
  Proximity contact = start;
  if (sum > 0.0 && !normal.isZero()) {
    contact.otherPoint = position / sum;
    contact.normal = normal.normalized();
  }
  contact.point = contact.otherPoint;
  return contact;
}

// Mean velocity (m/s) over the substep of the material point that is at `point` at its start.
Vec3 meanVelocity(const RigidMotion& of, const Vec3& point, double dt) {
  return of.centre.velocityAt(0.5 * dt) + of.angularVelocity.cross(point - of.centre.position);
}

// Velocity (m/s) of the point of a rim that is the farthest along `down` (unit), while the rim
// turns. That point is at e R from the rim's centre; e is `down` without its part along the axis,
// made unit.
Vec3 rimVelocity(const RigidMotion& of, const LocalShape& rim, const Vec3& point, const Vec3& down,
                 double dt) {
  const Vec3 across = down - down.dot(rim.rimAxis) * rim.rimAxis;
  const double length = across.norm();
  // A rim that lies almost flat rolls faster than steps can tell, or only rattles.
  const double lowest = 4.0 * kWeight * dt * dt / (rim.rimRadius * kFarthestTurn * kFarthestTurn);
  if (length <= lowest) return meanVelocity(of, point, dt);
  const Vec3 e = across / length;
  const Vec3 turning = of.angularVelocity.cross(rim.rimAxis);
  Vec3 change = -down.dot(turning) * rim.rimAxis - down.dot(rim.rimAxis) * turning;
  change -= change.dot(e) * e;
  return meanVelocity(of, point - rim.rimRadius * e, dt) + rim.rimRadius / length * change;
}

// Velocity (m/s) of the contact point: that of the centre of curvature of the more curved body, or
// of a point on a rim.
Vec3 contactVelocity(const PairMotion& now, const Proximity& contact, const LocalShape& shape,
                     const LocalShape& otherShape, double dt) {
  const double radius = shape.rollingRadius;
  const double otherRadius = otherShape.rollingRadius;
  if (shape.rimRadius > 0.0 && std::isinf(otherRadius))
    return rimVelocity(now.body(), shape, contact.point, -contact.normal, dt);
  if (otherShape.rimRadius > 0.0 && std::isinf(radius))
    return rimVelocity(now.other(), otherShape, contact.point, contact.normal, dt);
  if (std::isinf(radius) && std::isinf(otherRadius)) {
    return meanVelocity(now.body(), contact.point, dt);
  }
  return radius <= otherRadius
             ? meanVelocity(now.body(), contact.point + radius * contact.normal, dt)
             : meanVelocity(now.other(), contact.point - otherRadius * contact.normal, dt);
}

}  // namespace

// The local shapes are taken along the bridge's own normal: Bullet's is often askew by more than
// the angle that tells faces from edges.
PairCurvature curvatureOf(const PairMotion& now, const Proximity& start) {
  const ContactPair& pair = now.pair();
  return {now.shapeAt(PairSide::body, start), now.shapeAt(PairSide::other, start),
          pair.body->turned + pair.other->turned,
          pair.body->current.start - pair.other->current.start};
}

ContactState contactStateOf(const PairMotion& now, const Proximity& start,
                            const PairCurvature& curvature, const SolvedContact& solved,
                            const SubstepTime& substep) {
  const Proximity contact = meanContact(start, solved);
  const double dt = substep.length;
  const auto tangential = [&](const Vec3& v) {
    return Vec3(v - v.dot(contact.normal) * contact.normal);
  };
  const Vec3 bodyVelocity = meanVelocity(now.body(), contact.point, dt);
  const Vec3 otherVelocity = meanVelocity(now.other(), contact.point, dt);
  const LocalShape& shape = curvature.body;
  const LocalShape& otherShape = curvature.other;
  const Vec3 pointVelocity = contactVelocity(now, contact, shape, otherShape, dt);

  ContactState state;
  state.time = substep.start;
  state.duration = dt;
  state.body = now.pair().body->id;
  state.other = now.pair().other->id;
  state.normal = contact.normal;
  state.position = contact.point;
  state.normalLoad = std::max(0.0, solved.applied.dot(contact.normal)) / dt;
  state.appliedImpulse = solved.applied;
  state.radius = shape.radius;
  state.otherRadius = otherShape.radius;
  state.slipVelocity = tangential(bodyVelocity - otherVelocity);
  state.rollingVelocity = tangential(pointVelocity - 0.5 * (bodyVelocity + otherVelocity));

  const RigidMotion& body = now.body();
  const RigidMotion& other = now.other();
  const Vec3 end = contact.point + dt * pointVelocity;
  state.bodyPosition = body.centre.position;
  state.bodyOrientation = body.orientation;
  state.bodyVelocity = (body.centre.positionAt(dt) - body.centre.position) / dt;
  state.otherPosition = other.centre.position;
  state.otherOrientation = other.orientation;
  state.otherVelocity = (other.centre.positionAt(dt) - other.centre.position) / dt;
  state.pathStart = body.poseAt(0.0).toLocal(contact.point);
  state.pathEnd = body.poseAt(dt).toLocal(end);
  state.otherPathStart = other.poseAt(0.0).toLocal(contact.point);
  state.otherPathEnd = other.poseAt(dt).toLocal(end);
  return state;
}

}  // namespace carom::bullet
