#include "tests/bench/pair_reference.h"

#include <algorithm>
#include <cmath>

#include <btBulletDynamicsCommon.h>

namespace carom::bench {
namespace {

constexpr double kRestSpeed = 0.005;  // m/s, equal to the bridge's

Vec3 toVec3(const btVector3& v) {
  return {double(v.x()), double(v.y()), double(v.z())};
}

bool isMoved(const btRigidBody& body) {
  return !body.isStaticOrKinematicObject() && body.isActive();
}

// True if the velocities differ by more than rounding.
bool differs(const Vec3& velocity, const Vec3& expected) {
  constexpr double kRounding = 1e-5;
  return (velocity - expected).norm() > kRounding * (velocity.norm() + expected.norm());
}

Quat turnOf(const Vec3& rotation) {
  const double angle = rotation.norm();
  return Quat(Eigen::AngleAxisd(angle, angle > 0.0 ? Vec3(rotation / angle) : Vec3::UnitX()));
}

}  // namespace

Placement BodyPath::at(double time) const {
  return {position + time * (velocity + 0.5 * time * acceleration),
          (turnOf(time * angularVelocity) * orientation).toRotationMatrix()};
}

PairReference::PairReference(const btRigidBody& first, const btRigidBody& second,
                             double restitution, double restitutionThreshold)
    : restitution_(restitution), restitutionThreshold_(restitutionThreshold) {
  bodies_[0].body = &first;
  bodies_[1].body = &second;
  for (Body& body : bodies_)
    body.shape = ReferenceShape::of(*body.body->getCollisionShape());
}

void PairReference::beforeStep(double dt) {
  for (Body& body : bodies_) {
    const BodyPath way = body.actual;
    readNode(body, dt);
    if (time_ > 0.0) comparePath(way, body, dt);
  }
}

void PairReference::comparePath(const BodyPath& way, const Body& body, double dt) {
  const Placement end = way.at(dt);
  const Placement node = body.before.at(0.0);
  pathError_ = std::max({pathError_, (end.position - node.position).norm(),
                         body.shape.reach * (end.rotation - node.rotation).norm()});
}

void PairReference::readNode(Body& body, double dt) {
  const btQuaternion turned = body.body->getWorldTransform().getRotation();
  body.before.position = toVec3(body.body->getWorldTransform().getOrigin());
  body.before.orientation =
      Quat(double(turned.w()), double(turned.x()), double(turned.y()), double(turned.z()))
          .normalized();
  body.before.velocity = toVec3(body.body->getLinearVelocity());
  body.before.angularVelocity = toVec3(body.body->getAngularVelocity());
  body.free = body.before;
  if (!isMoved(*body.body)) return;
  body.free.acceleration = toVec3(body.body->getGravity());
  body.free.velocity += 0.5 * dt * body.free.acceleration;
  body.free.angularVelocity +=
      toVec3(body.body->computeGyroscopicImpulseImplicit_Body(btScalar(dt)));
}

void PairReference::readAfter(Body& body, double dt) {
  body.after = body.before;
  body.after.velocity = toVec3(body.body->getLinearVelocity());
  body.after.angularVelocity = toVec3(body.body->getAngularVelocity());
  body.actual = body.after;
  body.actual.acceleration = body.free.acceleration;
  body.actual.velocity -= 0.5 * dt * body.actual.acceleration;
  body.pushed = differs(body.actual.velocity, body.free.velocity) ||
                differs(body.actual.angularVelocity, body.free.angularVelocity);
}

double PairReference::gapAt(Way way, double time) const {
  return gapOf(bodies_[0].shape, (bodies_[0].*way).at(time), bodies_[1].shape,
               (bodies_[1].*way).at(time));
}

PairReference::Gradient PairReference::gradientOf(std::size_t which, Way way, double time) const {
  constexpr double kSmall = 1e-7;  // m and rad
  Placement places[2] = {(bodies_[0].*way).at(time), (bodies_[1].*way).at(time)};
  const Placement place = places[which];
  const auto gap = [&] { return gapOf(bodies_[0].shape, places[0], bodies_[1].shape, places[1]); };
  Gradient gradient;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    for (const double sign : {1.0, -1.0}) {
      const Vec3 change = sign * kSmall * Vec3::Unit(axis);
      places[which] = {place.position + change, place.rotation};
      gradient.shift[axis] += sign * gap() / (2.0 * kSmall);
      places[which] = {place.position, turnOf(change).toRotationMatrix() * place.rotation};
      gradient.turn[axis] += sign * gap() / (2.0 * kSmall);
    }
  }
  return gradient;
}

double PairReference::approachSpeed(Way place, double time, Way velocities) const {
  double speed = 0.0;
  for (std::size_t which = 0; which < 2; ++which) {
    const Gradient gradient = gradientOf(which, place, time);
    const BodyPath& path = bodies_[which].*velocities;
    const Vec3 velocity = path.velocity + time * path.acceleration;
    speed -= gradient.shift.dot(velocity) + gradient.turn.dot(path.angularVelocity);
  }
  return speed;
}

double PairReference::inverseMass(Way way, double time) const {
  double sum = 0.0;
  for (std::size_t which = 0; which < 2; ++which) {
    const Body& body = bodies_[which];
    const Gradient gradient = gradientOf(which, way, time);
    const Vec3 turn = (body.*way).at(time).rotation.transpose() * gradient.turn;
    sum += double(body.body->getInvMass()) * gradient.shift.squaredNorm() +
           turn.cwiseProduct(toVec3(body.body->getInvInertiaDiagLocal())).dot(turn);
  }
  return sum;
}

double PairReference::greatestSpeed(Way way, double horizon) const {
  const BodyPath& first = bodies_[0].*way;
  const BodyPath& second = bodies_[1].*way;
  double speed = (first.velocity - second.velocity).norm() +
                 horizon * (first.acceleration - second.acceleration).norm();
  for (const Body& body : bodies_)
    speed += body.shape.reach * (body.*way).angularVelocity.norm();
  return speed;
}

std::optional<double> PairReference::firstTouch(Way way, double horizon) const {
  constexpr double kLeast = 1e-6;  // s; shorter overlaps are passed over
  const double speed = greatestSpeed(way, horizon);
  double time = 0.0;
  double gap = gapAt(way, time);
  while (time < horizon) {
    const double next = std::min(horizon, time + std::max(kLeast, gap / speed));
    gap = gapAt(way, next);
    if (gap <= 0.0) return touchBetween(way, time, next);
    time = next;
  }
  return std::nullopt;
}

double PairReference::touchBetween(Way way, double early, double late) const {
  while (late - early > 1e-12) {
    const double middle = 0.5 * (early + late);
    (gapAt(way, middle) > 0.0 ? early : late) = middle;
  }
  return late;
}

void PairReference::afterStep(double dt) {
  for (Body& body : bodies_)
    readAfter(body, dt);
  gap_ = gapAt(&Body::before, 0.0);
  if (mayCollide(dt)) find(dt);
  time_ += dt;
}

bool PairReference::mayCollide(double dt) {
  const bool near = pushed() || gap_ <= dt * greatestSpeed(&Body::actual, dt);
  if (!collided_) return near;
  const double apart = bodies_[0].shape.reach + bodies_[0].shape.parts.front().core.rounding;
  const bool approaching = approachSpeed(&Body::before, 0.0, &Body::after) > kRestSpeed;
  if (!approaching || gap_ > apart) collided_ = false;
  return false;  // in this step Bullet still answers the last impact
}

void PairReference::find(double dt) {
  const double before = approachSpeed(&Body::before, 0.0, &Body::before);
  if (gap_ <= 0.0) return record(&Body::free, 0.0, before);
  if (pushed() && before > kRestSpeed) {
    // Bullet acts on a gap that closes within 1 + e substeps; the factor allows for rotation.
    const std::optional<double> touch = firstTouch(&Body::free, 1.1 * (1.0 + restitution_) * dt);
    if (!touch) ++needless_;
    return touch ? record(&Body::free, *touch, before) : void();
  }
  const std::optional<double> touch = firstTouch(&Body::actual, dt);
  if (touch) record(&Body::actual, *touch, approachSpeed(&Body::actual, *touch, &Body::after));
}

void PairReference::record(Way way, double time, double nodeSpeed) {
  if (!(nodeSpeed > kRestSpeed)) return;
  const double restitution = nodeSpeed < restitutionThreshold_ ? 0.0 : restitution_;
  const double speed = approachSpeed(way, time, way);
  const double mass = 1.0 / inverseMass(way, time);
  impacts_.push_back({.time = time_ + time,
                      .impulse = (1.0 + restitution) * mass * speed,
                      .speed = speed,
                      .mass = mass,
                      .node = time_,
                      .ahead = way == &Body::free});
  collided_ = approachSpeed(&Body::before, 0.0, &Body::after) > kRestSpeed;
}

}  // namespace carom::bench
