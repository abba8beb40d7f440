#include "bullet_bridge/lasting_contact.h"

#include <cmath>
#include <limits>

namespace carom {
namespace {

struct Meeting {
  Vec3 position;
  Vec3 normal;
};

// Mean of the points, weighted by load; where there is none, the nearest points of the two shapes.
Meeting meetingOf(const PairMotion& now, const SolvedContact& solved) {
  Meeting mean{Vec3::Zero(), Vec3::Zero()};
  double sum = 0.0;
  for (const SolvedPoint& point : solved.points) {
    mean.position += point.impulse * point.position;
    mean.normal += point.impulse * point.normal;
    sum += point.impulse;
  }
  if (sum > 0.0 && !mean.normal.isZero()) return {mean.position / sum, mean.normal.normalized()};
  const Proximity near = now.proximityAt(0.0);
  return {near.otherPoint, near.normal};
}

Proximity proximityOf(const PairMotion& now, const Meeting& meeting) {
  Proximity near = now.proximityAt(0.0);
  near.point = near.otherPoint = meeting.position;
  near.normal = meeting.normal;
  return near;
}

// m/s, mean over the substep, of the material point that is at `point` at its start.
Vec3 meanVelocity(const RigidMotion& of, const Vec3& point, double dt) {
  return of.centre.velocityAt(0.5 * dt) + of.angularVelocity.cross(point - of.centre.position);
}

// m/s, of the contact point: that of the centre of curvature of the more curved body.
Vec3 contactVelocity(const PairMotion& now, const Meeting& meeting, double dt) {
  const Proximity near = proximityOf(now, meeting);
  const double radius = now.rollingRadius(PairSide::body, near);
  const double otherRadius = now.rollingRadius(PairSide::other, near);
  if (std::isinf(radius) && std::isinf(otherRadius)) {
    return meanVelocity(now.body(), meeting.position, dt);
  }
  return radius <= otherRadius
             ? meanVelocity(now.body(), meeting.position + radius * meeting.normal, dt)
             : meanVelocity(now.other(), meeting.position - otherRadius * meeting.normal, dt);
}

}  // namespace

ContactState lastingContact(const PairMotion& now, const SolvedContact& solved, double time,
                            double dt) {
  const Meeting meeting = meetingOf(now, solved);
  const auto tangential = [&](const Vec3& v) {
    return Vec3(v - v.dot(meeting.normal) * meeting.normal);
  };
  const Vec3 bodyVelocity = meanVelocity(now.body(), meeting.position, dt);
  const Vec3 otherVelocity = meanVelocity(now.other(), meeting.position, dt);
  const Vec3 pointVelocity = contactVelocity(now, meeting, dt);

  ContactState state;
  state.time = time;
  state.duration = dt;
  state.body = now.pair().body->id;
  state.other = now.pair().other->id;
  state.normal = meeting.normal;
  state.position = meeting.position;
  state.normalLoad = std::max(0.0, solved.applied.dot(meeting.normal)) / dt;
  state.appliedImpulse = solved.applied;
  state.slipVelocity = tangential(bodyVelocity - otherVelocity);
  state.rollingVelocity = tangential(pointVelocity - 0.5 * (bodyVelocity + otherVelocity));

  const RigidMotion body = now.pair().body->actual(dt);
  const RigidMotion other = now.pair().other->actual(dt);
  const Vec3 end = meeting.position + dt * pointVelocity;
  state.pathStart = body.poseAt(0.0).toLocal(meeting.position);
  state.pathEnd = body.poseAt(dt).toLocal(end);
  state.otherPathStart = other.poseAt(0.0).toLocal(meeting.position);
  state.otherPathEnd = other.poseAt(dt).toLocal(end);
  return state;
}

}  // namespace carom
