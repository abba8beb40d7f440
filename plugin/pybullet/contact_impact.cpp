#include "plugin/pybullet/contact_impact.h"

#include <algorithm>
#include <cmath>

#include "bullet_bridge/geometry/impact_time.h"

namespace carom::plugin {

using namespace bullet;

namespace {

// Upper bound of how far ahead of time a solver acts: (1 + e) substeps.
constexpr double kSubstepsAhead = 2.0;

// Bounds of the cosine between a normal and an axis of the body: above kUpright the normal stands
// on a face, below kSideways on a cylinder's side.
constexpr double kUpright = 0.999;
constexpr double kSideways = 0.045;

bool isSphere(const ContactSide& side) {
  return side.body.form == ContactBody::Form::sphere;
}

Motion earlier(const Motion& motion, double seconds) {
  return {motion.positionAt(-seconds), motion.velocityAt(-seconds), motion.acceleration};
}

// Acceleration (m/s^2) of a corner or an edge on its path around the centre; 0 for other surfaces,
// which have no point that goes on touching.
Vec3 turningAcceleration(const ContactSide& side, const Vec3& point, const Vec3& normal) {
  if (curvatureOf(side.body, side.state.orientation, normal) > 0.0) return Vec3::Zero();
  const Vec3& spin = side.state.angularVelocity;
  return spin.cross(spin.cross(point - side.state.position));
}

// Returns the gap along the normal, as a motion along x. Half a step of acceleration is added for
// the centres only, as only their velocities jump at the nodes of symplectic Euler.
Motion gapOf(const ContactSide& body, const ContactSide& other, const TouchPoint& point,
             double dt) {
  const double pull = (body.acceleration - other.acceleration).dot(point.normal);
  const Vec3 turning = turningAcceleration(body, point.positionOnBody, point.normal) -
                       turningAcceleration(other, point.positionOnOther, point.normal);
  const double approach = approachAt(point, body.state, other.state);
  return {{point.distance, 0.0, 0.0},
          {0.5 * pull * dt - approach, 0.0, 0.0},
          {pull + turning.dot(point.normal), 0.0, 0.0}};
}

double flatTouchTime(const Motion& gap, double horizon) {
  return planeImpactTime(gap.position.x(), gap.velocity.x(), gap.acceleration.x(), horizon);
}

std::optional<Touch> touchAhead(const Motion& gap, const TouchPoint& point, double dt) {
  const double s = flatTouchTime(gap, kSubstepsAhead * dt);
  if (!std::isfinite(s)) return std::nullopt;
  return Touch{.s = s, .normal = point.normal, .approachSpeed = -gap.velocityAt(s).x()};
}

double onsetOf(const ContactSide& body, const ContactSide& other, const TouchPoint& point,
               const Motion& before) {
  const Vec3 gain =
      (body.state.velocity - body.velocityBefore) - (other.state.velocity - other.velocityBefore);
  const double approach = approachAt(point, body.state, other.state) + gain.dot(point.normal);
  const double fall = -2.0 * before.acceleration.x() * std::max(0.0, before.position.x());
  return std::sqrt(std::max(0.0, approach * approach + fall));
}

// Finds the touch of two spheres within the substep before, at whose end they overlap. Rounding may
// put the touch just beyond it.
Touch sphereTouch(const ContactSide& body, const ContactSide& other, double dt) {
  const Motion before = earlier(body.way(dt) - other.way(dt), dt);
  const double distance = body.body.radius + other.body.radius;
  const double s = std::min(dt, sphereImpactTime(before, distance, dt));
  Touch touch{.s = s - dt, .normal = before.positionAt(s).normalized()};
  touch.approachSpeed = -before.velocityAt(s).dot(touch.normal);
  return touch;
}

Touch flatTouch(const Motion& before, const TouchPoint& point, double dt) {
  const double s = std::min(dt, flatTouchTime(before, dt));
  return {.s = s - dt, .normal = point.normal, .approachSpeed = -before.velocityAt(s).x()};
}

// Inverse effective mass (1/kg) for an impulse along `normal` at the end of `lever`.
double inverseMass(const ContactSide& side, const Vec3& lever, const Vec3& normal) {
  if (!side.body.isMovable()) return 0.0;
  const Vec3 moment = side.state.orientation.conjugate() * lever.cross(normal);
  const Vec3& inertia = side.body.inertia;
  double sum = 1.0 / side.body.mass;
  for (int axis = 0; axis < 3; ++axis)
    sum += inertia[axis] > 0.0 ? moment[axis] * moment[axis] / inertia[axis] : 0.0;
  return sum;
}

// Lever (m) from the centre to the contact. `outwards` is the normal away from the body.
Vec3 leverOf(const ContactSide& side, const Vec3& point, const Vec3& outwards) {
  if (isSphere(side)) return side.body.radius * outwards;
  return point - side.state.position;
}

// Place (m, world frame) where the two touch.
Vec3 placeOf(const ContactSide& body, const ContactSide& other, const TouchPoint& point,
             const Touch& touch, double dt) {
  if (isSphere(body)) return body.way(dt).positionAt(touch.s) - body.body.radius * touch.normal;
  if (isSphere(other)) return other.way(dt).positionAt(touch.s) + other.body.radius * touch.normal;
  const Vec3 drift =
      velocityAt(body.state, point.positionOnBody) + velocityAt(other.state, point.positionOnOther);
  return 0.5 * (point.positionOnBody + point.positionOnOther + touch.s * drift);
}

double restitutionOf(const ContactSide& body, const ContactSide& other, double solved) {
  if (!body.body.restitution || !other.body.restitution) return std::clamp(solved, 0.0, 1.0);
  return std::clamp(*body.body.restitution * *other.body.restitution, 0.0, 1.0);
}

// Fills in the fields of one body, in an event that has those of the pair.
void fillIn(ImpulseEvent& event, const ContactSide& body, const ContactSide& other,
            const Motion& way, double s) {
  event.body = body.id;
  event.other = other.id;
  event.radius = curvatureOf(body.body, body.state.orientation, event.normal);
  event.otherRadius = curvatureOf(other.body, other.state.orientation, event.normal);
  event.bodyPosition = way.positionAt(s);
  event.bodyVelocity = way.velocityAt(s);
  event.bodyOrientation = body.state.orientation;
  event.bodyAngularVelocity = body.state.angularVelocity;
}

}  // namespace

Vec3 velocityAt(const BodyState& state, const Vec3& place) {
  return state.velocity + state.angularVelocity.cross(place - state.position);
}

double curvatureOf(const ContactBody& body, const Quat& orientation, const Vec3& normal) {
  constexpr double flat = std::numeric_limits<double>::infinity();
  const Vec3 local = (orientation.conjugate() * normal).cwiseAbs();
  const double radius = body.radius;
  switch (body.form) {
    case ContactBody::Form::sphere:
      return radius;
    case ContactBody::Form::box:
      return local.maxCoeff() > kUpright ? flat : 0.0;
    case ContactBody::Form::cylinder:
      if (local.z() > kUpright) return flat;
      return local.z() < kSideways ? 2.0 * radius : 0.0;
    case ContactBody::Form::capsule:
      return local.z() < kSideways ? 2.0 * radius : radius;
    case ContactBody::Form::plane:
      return flat;
    case ContactBody::Form::other:
      break;
  }
  return body.isMovable() ? 0.0 : flat;
}

double approachAt(const TouchPoint& point, const BodyState& body, const BodyState& other) {
  const Vec3 velocity =
      velocityAt(body, point.positionOnBody) - velocityAt(other, point.positionOnOther);
  return -velocity.dot(point.normal);
}

TouchPoint meanOf(std::span<const TouchPoint> points) {
  TouchPoint mean = points.front();
  Vec3 onBody = Vec3::Zero();
  Vec3 onOther = Vec3::Zero();
  Vec3 normal = Vec3::Zero();
  mean.impulse = 0.0;
  mean.distance = 0.0;
  mean.friction = Vec3::Zero();
  for (const TouchPoint& point : points) {
    mean.impulse += point.impulse;
    mean.friction += point.friction;
    mean.distance += point.impulse * point.distance;
    onBody += point.impulse * point.positionOnBody;
    onOther += point.impulse * point.positionOnOther;
    normal += point.impulse * point.normal;
  }
  mean.distance /= mean.impulse;
  mean.positionOnBody = onBody / mean.impulse;
  mean.positionOnOther = onOther / mean.impulse;
  if (normal.norm() > 0.0) mean.normal = normal.normalized();
  return mean;
}

std::optional<Touch> touchOf(const ContactSide& body, const ContactSide& other,
                             const TouchPoint& point, const ContactDurations& durations) {
  if (point.distance > 0.0)
    return touchAhead(gapOf(body, other, point, durations.now), point, durations.now);
  if (!body.hasPast || !other.hasPast) {  // the host put them there: the contact begins now
    return Touch{.normal = point.normal,
                 .approachSpeed = approachAt(point, body.state, other.state)};
  }
  const double dt = durations.before;
  const Motion before = earlier(gapOf(body, other, point, dt), dt);
  Touch touch = isSphere(body) && isSphere(other) ? sphereTouch(body, other, dt)
                                                  : flatTouch(before, point, dt);
  touch.onset = onsetOf(body, other, point, before);
  return touch;
}

double restitutionFrom(const ContactSide& body, const ContactSide& other, const TouchPoint& point,
                       double parting, double duration, const ContactSolver& solver) {
  const bool areRigid = body.body.isRigid() && other.body.isRigid();
  const double pull = (body.acceleration - other.acceleration).dot(point.normal);
  const double approach =
      approachAt(point, body.state, other.state) - (areRigid ? 0.0 : pull * duration);
  const double distance = point.distance + solver.slop;
  const bool isPushed = areRigid && distance <= solver.pushDistance;
  const double share = distance > 0.0 ? 1.0 : solver.erp;
  const double pushed = isPushed ? 0.0 : -distance / duration * share;
  return std::clamp((parting - pushed) / approach, 0.0, 1.0);
}

std::array<ImpulseEvent, 2> sharesOf(const ContactSide& body, const ContactSide& other,
                                     const Impact& impact, const ContactSolver& solver) {
  const TouchPoint& point = impact.point;
  const Touch& touch = impact.touch;
  const double duration = impact.duration;
  const double mass =
      1.0 / (inverseMass(body, leverOf(body, point.positionOnBody, -touch.normal), touch.normal) +
             inverseMass(other, leverOf(other, point.positionOnOther, touch.normal), touch.normal));
  const double momentum = mass * touch.approachSpeed;
  const double solved = impact.restitution.value_or(point.impulse / momentum - 1.0);
  const double e =
      touch.approachSpeed < solver.restitutionSpeed ? 0.0 : restitutionOf(body, other, solved);
  ImpulseEvent event;
  event.time = touch.s;
  event.effectiveMass = mass;
  event.approachSpeed = touch.approachSpeed;
  event.position = placeOf(body, other, point, touch, duration);
  event.normal = touch.normal;
  event.impulse = (1.0 + e) * momentum * event.normal;
  event.appliedImpulse = point.impulse * point.normal;
  event.hasAppliedImpulse = true;
  fillIn(event, body, other, body.way(duration), touch.s);
  ImpulseEvent reaction = event;
  reaction.normal = -event.normal;
  reaction.impulse = -event.impulse;
  reaction.appliedImpulse = -event.appliedImpulse;
  fillIn(reaction, other, body, other.way(duration), touch.s);
  exchangePoses(event, reaction);
  return {event, reaction};
}

}  // namespace carom::plugin
