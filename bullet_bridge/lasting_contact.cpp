#include "bullet_bridge/lasting_contact.h"

#include <cmath>
#include <limits>

namespace carom {
namespace {

// Where they meet, as one point of both: the mean of the points, weighted by load. Where there is
// no load, the nearest point of the other.
Proximity meetingOf(const Proximity& start, const SolvedContact& solved) {
  Vec3 position = Vec3::Zero();
  Vec3 normal = Vec3::Zero();
  double sum = 0.0;
  for (const SolvedPoint& point : solved.points) {
    position += point.impulse * point.position;
    normal += point.impulse * point.normal;
    sum += point.impulse;
  }
  Proximity meeting = start;
  if (sum > 0.0 && !normal.isZero()) {
    meeting.otherPoint = position / sum;
    meeting.normal = normal.normalized();
  }
  meeting.point = meeting.otherPoint;
  return meeting;
}

// m/s, mean over the substep, of the material point that is at `point` at its start.
Vec3 meanVelocity(const RigidMotion& of, const Vec3& point, double dt) {
  return of.centre.velocityAt(0.5 * dt) + of.angularVelocity.cross(point - of.centre.position);
}

// m/s, of the contact point: that of the centre of curvature of the more curved body.
Vec3 contactVelocity(const PairMotion& now, const Proximity& meeting, double dt) {
  const double radius = now.rollingRadius(PairSide::body, meeting);
  const double otherRadius = now.rollingRadius(PairSide::other, meeting);
  if (std::isinf(radius) && std::isinf(otherRadius)) {
    return meanVelocity(now.body(), meeting.point, dt);
  }
  return radius <= otherRadius
             ? meanVelocity(now.body(), meeting.point + radius * meeting.normal, dt)
             : meanVelocity(now.other(), meeting.point - otherRadius * meeting.normal, dt);
}

}  // namespace

ContactState lastingContact(const PairMotion& now, const Proximity& start,
                            const SolvedContact& solved, const SubstepTime& substep) {
  const Proximity meeting = meetingOf(start, solved);
  const double dt = substep.length;
  const auto tangential = [&](const Vec3& v) {
    return Vec3(v - v.dot(meeting.normal) * meeting.normal);
  };
  const Vec3 bodyVelocity = meanVelocity(now.body(), meeting.point, dt);
  const Vec3 otherVelocity = meanVelocity(now.other(), meeting.point, dt);
  const Vec3 pointVelocity = contactVelocity(now, meeting, dt);

  ContactState state;
  state.time = substep.start;
  state.duration = dt;
  state.body = now.pair().body->id;
  state.other = now.pair().other->id;
  state.normal = meeting.normal;
  state.position = meeting.point;
  state.normalLoad = std::max(0.0, solved.applied.dot(meeting.normal)) / dt;
  state.appliedImpulse = solved.applied;
  state.slipVelocity = tangential(bodyVelocity - otherVelocity);
  state.rollingVelocity = tangential(pointVelocity - 0.5 * (bodyVelocity + otherVelocity));

  const RigidMotion body = now.pair().body->actual(dt);
  const RigidMotion other = now.pair().other->actual(dt);
  const Vec3 end = meeting.point + dt * pointVelocity;
  state.bodyPosition = body.centre.position;
  state.bodyOrientation = body.orientationAt(0.0);
  state.bodyVelocity = (body.centre.positionAt(dt) - body.centre.position) / dt;
  state.otherPosition = other.centre.position;
  state.otherOrientation = other.orientationAt(0.0);
  state.otherVelocity = (other.centre.positionAt(dt) - other.centre.position) / dt;
  state.pathStart = body.poseAt(0.0).toLocal(meeting.point);
  state.pathEnd = body.poseAt(dt).toLocal(end);
  state.otherPathStart = other.poseAt(0.0).toLocal(meeting.point);
  state.otherPathEnd = other.poseAt(dt).toLocal(end);
  return state;
}

}  // namespace carom
