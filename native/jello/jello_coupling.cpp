#include "native/jello/jello_coupling.h"

#include <algorithm>
#include <utility>

#include "native/spheres/event_pair.h"

namespace carom::native {
JelloWorld withSpheres(JelloWorld jello, const SphereWorld& spheres) {
  for (const Sphere& sphere : spheres.spheres)
    jello.balls.push_back(
        {sphere.id, sphere.radius, sphere.mass, sphere.position, sphere.velocity});
  jello.ballsAreLed = true;
  return jello;
}

Result<JelloCoupling> JelloCoupling::create(JelloWorld jello, const SphereWorld& spheres,
                                            const JelloStepping& stepping) {
  if (!jello.balls.empty())
    return Error{"jello: it has balls of its own; expected none beside spheres"};
  Result<JelloStepper> stepper = JelloStepper::create(withSpheres(std::move(jello), spheres),
                                                      stepping.integrator, stepping.step);
  if (!stepper) return stepper.error();
  if (stepping.promise.error > 0.0) stepper->follow(stepping.promise);
  Result<SphereStepper> rigid = SphereStepper::create(spheres);
  if (!rigid) return rigid.error();
  JelloCoupling coupling(*std::move(stepper), *std::move(rigid), spheres.restSpeed);
  coupling.firstShare_ = orderOf(stepping.integrator) > 1 ? 0.5 : 1.0;
  return coupling;
}

JelloCoupling::JelloCoupling(JelloStepper jello, SphereStepper spheres, double restSpeed)
    : jello_(std::move(jello)),
      spheres_(std::move(spheres)),
      restSpeed_(restSpeed),
      firstShare_(1.0),
      jelloMass_(jello_.world().lattice.pointMass *
                 static_cast<double>(jello_.world().pointCount())),
      touches_(jello_.world().balls.size()) {}

Status JelloCoupling::advance() {
  events_.clear();
  const double begin = jello_.time();
  const std::span<const JelloBall> balls = jello_.world().balls;
  std::vector<Vec3> impulses(balls.size());
  for (std::size_t ball = 0; ball < balls.size(); ++ball)
    impulses[ball] =
        -balls[ball].mass * (jello_.ballVelocity(ball) + jello_.step() * jello_.world().gravity);
  if (Status stepped = jello_.advance(); !stepped) return stepped;
  const std::span<const JelloTouch> touches = jello_.touches();
  for (std::size_t ball = 0; ball < balls.size(); ++ball) {
    if (!touches[ball].isThere) continue;
    impulses[ball] += balls[ball].mass * jello_.ballVelocity(ball);
    addImpulse(ball, touches[ball], begin, impulses[ball]);
    spheres_.push(ball, firstShare_ * impulses[ball]);
  }
  const std::span<const ImpulseEvent> collisions = spheres_.advanceTo(jello_.time());
  events_.assign(collisions.begin(), collisions.end());
  for (std::size_t ball = 0; ball < balls.size(); ++ball)
    if (firstShare_ < 1.0 && touches[ball].isThere)
      spheres_.push(ball, (1.0 - firstShare_) * impulses[ball]);
  endTouches();
  placeBalls();
  return std::monostate{};
}

void JelloCoupling::pushSphere(std::size_t sphere, const Vec3& velocityChange) {
  spheres_.push(sphere, jello_.world().balls[sphere].mass * velocityChange);
  placeBalls();
}

/// Moves the jello's balls to the places of the spheres.
void JelloCoupling::placeBalls() {
  for (std::size_t ball = 0; ball < touches_.size(); ++ball) {
    const SphereState state = spheres_.state(ball);
    jello_.setBall(ball, state.position, state.velocity);
  }
}

void JelloCoupling::addImpulse(std::size_t ball, const JelloTouch& touch, double begin,
                               const Vec3& impulse) {
  std::optional<Touch>& current = touches_[ball];
  if (!current && touch.impulse.isZero(0.0)) return;
  if (!current) {
    current = {.begin = begin, .point = touch.point, .sphere = spheres_.state(ball)};
    current->jelloVelocity = touch.velocity;
    current->approachSpeed =
        touch.impulse.normalized().dot(touch.velocity - current->sphere.velocity);
  }
  current->last = begin;
  current->impulse += impulse;
}

void JelloCoupling::endTouches() {
  const double now = jello_.time();
  for (std::size_t ball = 0; ball < touches_.size(); ++ball) {
    std::optional<Touch>& touch = touches_[ball];
    if (!touch) continue;
    const bool isOver = now - touch->last > kSameTouch + jello_.step();
    if (!touch->isTold && (isOver || now - touch->begin > kLongestTouch)) report(ball, *touch);
    if (isOver) touch.reset();
  }
}

void JelloCoupling::report(std::size_t ball, Touch& touch) {
  touch.isTold = true;
  const double size = touch.impulse.norm();
  if (!(touch.approachSpeed > 0.0 && touch.approachSpeed >= restSpeed_ && size > 0.0)) return;
  const JelloBall& body = jello_.world().balls[ball];
  const Vec3 normal = touch.impulse / size;
  const Side sphere{
      body.id,          body.radius,      touch.sphere.position, touch.sphere.velocity,
      Quat::Identity(), touch.sphere.spin};
  const Side jello{jello_.world().id, kNever, touch.point, touch.jelloVelocity};
  const double mass = body.mass * jelloMass_ / (body.mass + jelloMass_);
  const auto pair = eventsOf(sphere, jello, {normal, touch.approachSpeed, mass, size}, touch.begin);
  events_.insert(events_.end(), pair.begin(), pair.end());
}

double JelloCoupling::settledTime() const {
  double settled = jello_.time();
  for (const std::optional<Touch>& touch : touches_)
    if (touch && !touch->isTold) settled = std::min(settled, touch->begin);
  return settled;
}

}  // namespace carom::native
