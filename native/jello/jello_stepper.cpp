#include "native/jello/jello_stepper.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <span>
#include <string>
#include <utility>

#include "native/jello/jello_implicit.h"

namespace carom::native {
namespace {

/// Distance, in sizes of the jello, beyond which a point has blown up.
constexpr double kFarApart = 100.0;

Vec3 fieldAt(const JelloField& field, const Vec3& point) {
  if (field.count == 1) return field.forces.front();
  const auto last = static_cast<double>(field.count - 1);
  const Vec3 scaled = ((point - field.min).cwiseQuotient(field.max - field.min) * last)
                          .cwiseMax(0.0)
                          .cwiseMin(last);
  std::array<std::size_t, 3> cell{};
  Vec3 share;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto index = static_cast<Eigen::Index>(axis);
    cell[axis] = std::min(static_cast<std::size_t>(scaled[index]), field.count - 2);
    share[index] = scaled[index] - static_cast<double>(cell[axis]);
  }
  Vec3 sum = Vec3::Zero();
  for (const std::size_t x : {0U, 1U})
    for (const std::size_t y : {0U, 1U})
      for (const std::size_t z : {0U, 1U})
        sum +=
            (x == 0 ? 1.0 - share.x() : share.x()) * (y == 0 ? 1.0 - share.y() : share.y()) *
            (z == 0 ? 1.0 - share.z() : share.z()) *
            field.forces[((cell[0] + x) * field.count + cell[1] + y) * field.count + cell[2] + z];
  return sum;
}

std::vector<JelloWall> wallsOf(const JelloWorld& world) {
  std::vector<JelloWall> walls;
  const auto add = [&](const Vec3& normal, double offset) {
    walls.push_back({{normal.x(), normal.y(), normal.z()},
                     offset,
                     world.contact.stiffness,
                     world.contact.damping});
  };
  if (world.room) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      add(Vec3::Unit(axis), world.room->min[axis]);
      add(-Vec3::Unit(axis), -world.room->max[axis]);
    }
  }
  for (const JelloPlane& plane : world.planes)
    add(plane.normal, plane.offset);
  return walls;
}

Vec3 normalOf(const JelloWall& wall) {
  return {wall.normal[0], wall.normal[1], wall.normal[2]};
}

}  // namespace

Result<JelloStepper> JelloStepper::create(JelloWorld world, JelloIntegrator integrator,
                                          double step) {
  if (const Status valid = validate(world); !valid) return Error{"jello: " + valid.error().message};
  if (!(std::isfinite(step) && step > 0.0)) return Error{"jello: the step must be positive (s)"};
  return JelloStepper(std::move(world), integrator, step);
}

JelloStepper::JelloStepper(JelloWorld world, JelloIntegrator integrator, double step)
    : world_(std::move(world)),
      integrator_(integrator),
      step_(step),
      part_(step),
      springs_(world_.lattice),
      skin_(world_.lattice.count),
      walls_(wallsOf(world_)),
      now_(6 * stride(), 0.0),
      inverseMass_(bodies(), 1.0 / world_.lattice.pointMass),
      touches_(world_.balls.size()),
      touchSizes_(world_.balls.size()) {
  accelerations_.fill(Values(3 * stride(), 0.0));
  stage_ = now_;
  if (parts() > 1) {
    upperForces_.assign(3 * stride(), 0.0);
    if (JelloWorker::isOfUse()) worker_ = std::make_unique<JelloWorker>();
  }
  for (std::size_t point = 0; point < world_.pointCount(); ++point) {
    put(0, point, world_.positions[point]);
    put(3, point, world_.velocities[point]);
  }
  for (std::size_t ball = 0; ball < world_.balls.size(); ++ball) {
    setBall(ball, world_.balls[ball].position, world_.balls[ball].velocity);
    inverseMass_[world_.pointCount() + ball] = 1.0 / world_.balls[ball].mass;
  }
  before_ = now_;
}

Vec3 JelloStepper::at(std::size_t array, std::size_t index) const {
  const double* first = now_.data() + array * stride() + kJelloSlack + index;
  return {first[0], first[stride()], first[2 * stride()]};
}

void JelloStepper::put(std::size_t array, std::size_t index, const Vec3& value) {
  double* first = now_.data() + array * stride() + kJelloSlack + index;
  for (const double coordinate : value) {
    *first = coordinate;
    first += stride();
  }
}

void JelloStepper::setBall(std::size_t ball, const Vec3& position, const Vec3& velocity) {
  put(0, world_.pointCount() + ball, position);
  put(3, world_.pointCount() + ball, velocity);
}

/// Arrays for the kernels; the forces are written where the accelerations will be.
JelloArrays JelloStepper::arraysOf(const Values& values, Values& accelerations) const {
  JelloArrays arrays;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    arrays.positions[axis] = values.data() + axis * stride() + kJelloSlack;
    arrays.velocities[axis] = values.data() + (axis + 3) * stride() + kJelloSlack;
    arrays.forces[axis] = accelerations.data() + axis * stride() + kJelloSlack;
  }
  return arrays;
}

void JelloStepper::addField(const JelloArrays& arrays) const {
  if (world_.field.count == 0) return;
  for (std::size_t point = 0; point < world_.pointCount(); ++point) {
    const Vec3 force = fieldAt(
        world_.field,
        {arrays.positions[0][point], arrays.positions[1][point], arrays.positions[2][point]});
    for (std::size_t axis = 0; axis < 3; ++axis)
      arrays.forces[axis][point] += force[static_cast<Eigen::Index>(axis)];
  }
}

namespace {

Vec3 placeOf(const std::array<const double*, 3>& of, std::size_t index) {
  return {of[0][index], of[1][index], of[2][index]};
}

void push(const JelloArrays& arrays, std::size_t index, const Vec3& force) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    arrays.forces[axis][index] += force[static_cast<Eigen::Index>(axis)];
}

/// Bounds of the points, which tell whether a ball could reach any of them.
class Bounds {
 public:
  Bounds(const std::array<const double*, 3>& places, std::size_t points) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto [least, most] = std::minmax_element(places[axis], places[axis] + points);
      min_[static_cast<Eigen::Index>(axis)] = *least;
      max_[static_cast<Eigen::Index>(axis)] = *most;
    }
  }
  bool isNear(const Vec3& centre, double radius) const {
    return ((centre - min_).array() >= -radius).all() && ((centre - max_).array() <= radius).all();
  }

 private:
  Vec3 min_;
  Vec3 max_;
};

}  // namespace

/// Adds the push between a ball and the skin: it acts on the corners of the triangle that holds the
/// nearest place of the skin.
void JelloStepper::pushBySkin(std::size_t ball, const JelloArrays& arrays, double share) {
  const std::size_t self = world_.pointCount() + ball;
  const auto contact =
      skin_.meet(arrays.positions, placeOf(arrays.positions, self), world_.balls[ball].radius);
  if (!contact) return;
  Vec3 velocity = Vec3::Zero();
  for (std::size_t corner = 0; corner < 3; ++corner)
    velocity += contact->weights[corner] * placeOf(arrays.velocities, contact->points[corner]);
  const double speed = contact->normal.dot(placeOf(arrays.velocities, self) - velocity);
  const double size =
      std::max(0.0, world_.contact.stiffness * contact->depth - world_.contact.damping * speed);
  push(arrays, self, size * contact->normal);
  for (std::size_t corner = 0; corner < 3; ++corner)
    push(arrays, contact->points[corner], -(size * contact->weights[corner]) * contact->normal);
  JelloTouch& touch = touches_[ball];
  touch.isThere = true;
  touch.impulse += (share * part_ * size) * contact->normal;
  touch.point += share * size * contact->place;
  touch.velocity += share * size * velocity;
  touchSizes_[ball] += share * size;
}

/// Adds the pushes between balls and walls, the jello and each other; `share` is the part of the
/// step that this stage stands for.
void JelloStepper::addBalls(const JelloArrays& arrays, double share) {
  if (world_.balls.empty()) return;
  const std::size_t points = world_.pointCount();
  const Bounds bounds(arrays.positions, points);
  for (std::size_t ball = 0; ball < world_.balls.size(); ++ball) {
    const std::size_t self = points + ball;
    const Vec3 centre = placeOf(arrays.positions, self);
    const Vec3 velocity = placeOf(arrays.velocities, self);
    const double radius = world_.balls[ball].radius;
    if (bounds.isNear(centre, radius)) pushBySkin(ball, arrays, share);
    if (world_.ballsAreLed) continue;
    for (const JelloWall& wall : walls_) {
      const Vec3 normal = normalOf(wall);
      const double depth = wall.offset + radius - normal.dot(centre);
      if (depth > 0.0)
        push(arrays, self,
             std::max(0.0, wall.stiffness * depth - wall.damping * normal.dot(velocity)) * normal);
    }
    for (std::size_t other = points; other < self; ++other) {
      const double reach = radius + world_.balls[other - points].radius;
      const Vec3 away = centre - placeOf(arrays.positions, other);
      const double distance = away.norm();
      if (!(distance < reach && distance > 0.0)) continue;
      const Vec3 normal = away / distance;
      const double speed = normal.dot(velocity - placeOf(arrays.velocities, other));
      const Vec3 force = std::max(0.0, world_.contact.stiffness * (reach - distance) -
                                           world_.contact.damping * speed) *
                         normal;
      push(arrays, self, force);
      push(arrays, other, -force);
    }
  }
}

std::size_t JelloStepper::parts() const {
  return world_.lattice.count >= kSplitFrom ? 2 : 1;
}

void JelloStepper::inParts(const std::function<void(std::size_t)>& part) {
  if (worker_) {
    worker_->run(part);
    return;
  }
  for (std::size_t which = 0; which < parts(); ++which)
    part(which);
}

/// Adds the forces of the springs. Those that begin in the second half of the slabs add into arrays
/// of their own, as springs of the first half push its first slabs too; then both are summed. So no
/// bit depends on which half is done first.
void JelloStepper::addSprings(const JelloArrays& arrays) {
  if (springs_.stiffness == 0.0 && springs_.damping == 0.0) return;
  const std::size_t n = world_.lattice.count;
  if (parts() == 1) {
    jelloKernel().addSprings(springs_, {0, n}, arrays);
    return;
  }
  const std::size_t half = n / 2;
  const std::size_t lower = half * n * n;  // points
  JelloArrays upper = arrays;
  for (std::size_t axis = 0; axis < 3; ++axis)
    upper.forces[axis] = upperForces_.data() + axis * stride() + kJelloSlack;
  inParts([&](std::size_t part) {
    if (part == 0) {
      jelloKernel().addSprings(springs_, {0, half}, arrays);
      return;
    }
    for (double* forces : upper.forces)
      std::fill(forces + lower - kJelloSlack, forces + n * n * n + kJelloSlack, 0.0);
    jelloKernel().addSprings(springs_, {half, n}, upper);
  });
  inParts([&](std::size_t part) {
    const std::size_t middle = lower + (n * n * n - lower) / 2;
    const std::size_t first = part == 0 ? lower : middle;
    const std::size_t end = part == 0 ? middle : n * n * n;
    for (std::size_t axis = 0; axis < 3; ++axis)
      jelloKernel().sum({.out = arrays.forces[axis] + first,
                         .base = arrays.forces[axis] + first,
                         .count = end - first,
                         .terms = 1,
                         .factors = {1.0},
                         .values = {upper.forces[axis] + first}});
  });
}

/// Computes the accelerations (m/s^2) of points and balls.
void JelloStepper::accelerate(const Values& values, double share, Values& accelerations) {
  ++evaluations_;
  std::ranges::fill(accelerations, 0.0);
  const JelloArrays arrays = arraysOf(values, accelerations);
  addSprings(arrays);
  for (const JelloWall& wall : walls_)
    jelloKernel().addWall(wall, world_.pointCount(), arrays);
  addField(arrays);
  addBalls(arrays, share);
  for (std::size_t axis = 0; axis < 3; ++axis)
    jelloKernel().accelerate(inverseMass_.data(), world_.gravity[static_cast<Eigen::Index>(axis)],
                             inverseMass_.size(), arrays.forces[axis]);
}

/// The terms that `combine` adds to the places or the velocities of `now_`.
struct JelloStepper::Terms {
  std::size_t count = 0;
  std::array<double, JelloSum::kMost> factors{};
  std::array<const double*, JelloSum::kMost> values{};

  Terms(std::initializer_list<std::pair<double, const double*>> terms) {
    for (const auto& [factor, of] : terms) {
      factors[count] = factor;
      values[count++] = of;
    }
  }
};

/// Sets out = now_ plus the terms for its places and for its velocities.
void JelloStepper::combine(const Terms& places, const Terms& speeds, Values& out) {
  const std::size_t half = 3 * stride();
  const auto sumUp = [&](const Terms& terms, std::size_t array, std::size_t first,
                         std::size_t end) {
    JelloSum sum{.out = out.data() + array + first,
                 .base = now_.data() + array + first,
                 .count = end - first,
                 .terms = terms.count,
                 .factors = terms.factors,
                 .values = terms.values};
    for (std::size_t term = 0; term < terms.count; ++term)
      sum.values[term] += first;
    jelloKernel().sum(sum);
  };
  const std::size_t middle = half / 2 / kJelloBlock * kJelloBlock;
  inParts([&](std::size_t part) {
    const std::size_t first = part == 0 ? 0 : middle;
    const std::size_t end = part == 0 && parts() > 1 ? middle : half;
    sumUp(places, 0, first, end);
    sumUp(speeds, half, first, end);
  });
}

void JelloStepper::explicitStep() {
  const double* speeds = now_.data() + 3 * stride();
  accelerate(now_, 1.0, accelerations_[0]);
  combine({{part_, speeds}}, {{part_, accelerations_[0].data()}}, before_);
  std::swap(now_, before_);
}

void JelloStepper::symplecticStep() {
  const double* speeds = now_.data() + 3 * stride();
  const double* pushes = accelerations_[0].data();
  accelerate(now_, 1.0, accelerations_[0]);
  combine({{part_, speeds}, {part_ * part_, pushes}}, {{part_, pushes}}, before_);
  std::swap(now_, before_);
}

void JelloStepper::midpointStep() {
  const double* speeds = now_.data() + 3 * stride();
  const double* middleSpeeds = stage_.data() + 3 * stride();
  accelerate(now_, 0.0, accelerations_[0]);
  combine({{0.5 * part_, speeds}}, {{0.5 * part_, accelerations_[0].data()}}, stage_);
  accelerate(stage_, 1.0, accelerations_[1]);
  combine({{part_, middleSpeeds}}, {{part_, accelerations_[1].data()}}, before_);
  std::swap(now_, before_);
}

/// The classic Runge-Kutta method, with the velocities of its stages inserted: x + h v + h^2 (a1 +
/// a2 + a3) / 6.
void JelloStepper::rungeKuttaStep() {
  const double h = part_;
  const double* v = now_.data() + 3 * stride();
  std::array<const double*, 4> a{};
  for (std::size_t stage = 0; stage < 4; ++stage)
    a[stage] = accelerations_[stage].data();
  accelerate(now_, 1.0 / 6.0, accelerations_[0]);
  combine({{0.5 * h, v}}, {{0.5 * h, a[0]}}, stage_);
  accelerate(stage_, 1.0 / 3.0, accelerations_[1]);
  combine({{0.5 * h, v}, {0.25 * h * h, a[0]}}, {{0.5 * h, a[1]}}, stage_);
  accelerate(stage_, 1.0 / 3.0, accelerations_[2]);
  combine({{h, v}, {0.5 * h * h, a[1]}}, {{h, a[2]}}, stage_);
  accelerate(stage_, 1.0 / 6.0, accelerations_[3]);
  const double sixth = h / 6.0;
  combine({{h, v}, {h * sixth, a[0]}, {h * sixth, a[1]}, {h * sixth, a[2]}},
          {{sixth, a[0]}, {2.0 * sixth, a[1]}, {2.0 * sixth, a[2]}, {sixth, a[3]}}, before_);
  std::swap(now_, before_);
}

/// Solves (M - h C - h^2 K) dv = h (F + h K v), with the stiffness K and the damping C as they are
/// now (Baraff, Witkin 1998, "Large steps in cloth simulation", eq. 6); then moves x by the new
/// velocities.
void JelloStepper::implicitStep() {
  before_ = now_;
  accelerate(now_, 1.0, accelerations_[0]);
  const JelloImplicit system({world_, springs_, skin_, walls_, part_});
  const std::size_t count = bodies();
  Eigen::VectorXd forces(static_cast<Eigen::Index>(3 * count));
  std::vector<Vec3> positions(count);
  std::vector<Vec3> velocities(count);
  for (std::size_t index = 0; index < count; ++index) {
    positions[index] = at(0, index);
    velocities[index] = at(3, index);
    for (std::size_t axis = 0; axis < 3; ++axis)
      forces[static_cast<Eigen::Index>(3 * index + axis)] =
          accelerations_[0][axis * stride() + kJelloSlack + index] / inverseMass_[index];
  }
  const Eigen::VectorXd change = system.velocityChange(positions, velocities, forces);
  for (std::size_t index = 0; index < count; ++index) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t place = axis * stride() + kJelloSlack + index;
      now_[place + 3 * stride()] += change[static_cast<Eigen::Index>(3 * index + axis)];
      now_[place] += part_ * now_[place + 3 * stride()];
    }
  }
}

/// Moves by half of the way, changes the velocities by the forces there, and moves on by the other
/// half. The velocities there, which dampers need, are extrapolated by the acceleration of the part
/// before.
void JelloStepper::leapfrogStep() {
  const double h = part_;
  const double* v = now_.data() + 3 * stride();
  std::swap(accelerations_[0], accelerations_[1]);
  combine({{0.5 * h, v}}, {{0.5 * h, accelerations_[1].data()}}, stage_);
  accelerate(stage_, 1.0, accelerations_[0]);
  const double* push = accelerations_[0].data();
  combine({{h, v}, {0.5 * h * h, push}}, {{h, push}}, before_);
  std::swap(now_, before_);
}

void JelloStepper::stepOnce() {
  switch (integrator_) {
    case JelloIntegrator::explicitEuler:
      return explicitStep();
    case JelloIntegrator::symplecticEuler:
      return symplecticStep();
    case JelloIntegrator::midpoint:
      return midpointStep();
    case JelloIntegrator::rungeKutta4:
      return rungeKuttaStep();
    case JelloIntegrator::backwardEuler:
      return implicitStep();
    case JelloIntegrator::leapfrog:
      return leapfrogStep();
  }
}

/// True if a number is not finite, or a point is far away from the first.
bool JelloStepper::hasBlownUp() const {
  const double far = kFarApart * world_.lattice.size.maxCoeff();
  constexpr double kMost = std::numeric_limits<double>::max();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double* places = now_.data() + axis * stride() + kJelloSlack;
    const double* speeds = places + 3 * stride();
    if (!std::isfinite(places[0]) ||
        !jelloKernel().areWithin(places, places[0], far, world_.pointCount()) ||
        !jelloKernel().areWithin(places + world_.pointCount(), 0.0, kMost, world_.balls.size()) ||
        !jelloKernel().areWithin(speeds, 0.0, kMost, bodies()))
      return true;
  }
  return false;
}

void JelloStepper::follow(const JelloPromise& promise) {
  promise_ = promise;
  start_ = now_;
  if (integrator_ != JelloIntegrator::leapfrog) return;
  // The first part compares its accelerations with those at the begin, half a part before.
  accelerate(now_, 0.0, accelerations_[0]);
  startPush_ = accelerations_[0];
  // A jello that is let go at rest is in the middle of the first part where it was at its begin:
  // the two accelerations are the same, and tell nothing of the part's error. So it has to be
  // short.
  if (std::isfinite(promise.error)) parts_ = kMostParts;
}

void JelloStepper::beginTouches() {
  std::ranges::fill(touches_, JelloTouch{});
  std::ranges::fill(touchSizes_, 0.0);
}

/// Root mean square over the points of one - two - share x third: for accelerations, or with an
/// offset of half the values for velocities.
double JelloStepper::rootMeanSquare(const double* one, const double* two, double share,
                                    const double* third) const {
  std::array<double, 3> sums{};
  for (std::size_t point = kJelloSlack; point < kJelloSlack + world_.pointCount(); ++point) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t at = axis * stride() + point;
      const double apart = one[at] - two[at] - share * third[at];
      sums[axis] += apart * apart;
    }
  }
  return std::sqrt((sums[0] + sums[1] + sums[2]) / static_cast<double>(world_.pointCount()));
}

/// Error (m, root mean square over the points) that the last part has added, estimated without
/// another evaluation. Leapfrog: h^3 / 12 of the third derivative of a place, taken from two
/// accelerations: of what swings at w, twice the error of its phase, (w h)^3 / 24. Runge-Kutta: the
/// distance from the method of third order whose last stage is taken at the end of the part, h / 6
/// of the difference of two velocities, times w h, where w is the frequency by which accelerations
/// and velocities change: (w h)^5 / 72, where the error of the phase is (w h)^5 / 120.
double JelloStepper::partError() const {
  const double* push = accelerations_[0].data();
  if (integrator_ == JelloIntegrator::leapfrog) {
    const double change = rootMeanSquare(push, accelerations_[1].data(), 0.0, push);
    return part_ * part_ * part_ / 12.0 * change / lastPart_;
  }
  const double* after = now_.data() + 3 * stride();
  const double* before = before_.data() + 3 * stride();
  const double apart = rootMeanSquare(after, before, part_, accelerations_[2].data());
  const double speedUp = rootMeanSquare(after, before, 0.0, push);
  const double change = rootMeanSquare(accelerations_[3].data(), push, 0.0, push);
  const double swing = speedUp > 0.0 ? std::min(1.0, part_ * change / speedUp) : 0.0;
  return part_ / 6.0 * apart * swing;
}

/// Error (m) that the next step may add.
double JelloStepper::allowedError() const {
  constexpr double kAtOnce = 0.05;
  const double evenly = 0.5 * promise_.error * step_ / promise_.seconds;
  return std::max(evenly, kAtOnce * (0.5 * promise_.error - spent_));
}

/// Runs the parts of a step; returns the error (m) that they add.
double JelloStepper::runParts() {
  beginTouches();
  part_ = step_ / static_cast<double>(parts_);
  double error = 0.0;
  for (std::size_t part = 0; part < parts_; ++part) {
    const double before = steps_ == 0 && part == 0 ? 0.0 : lastPart_;
    stepOnce();
    lastPart_ = 0.5 * (before + part_);
    error += partError();
    lastPart_ = part_;
  }
  return error;
}

/// Runs a step in as many parts as its error asks for.
void JelloStepper::followStep() {
  const bool isLeapfrog = integrator_ == JelloIntegrator::leapfrog;
  const double order = orderOf(integrator_);
  const double allowed = allowedError();
  const double lastPart = lastPart_;
  start_ = now_;
  if (isLeapfrog) startPush_ = accelerations_[0];
  double error = runParts();
  while (error > allowed && parts_ < kMostParts) {
    const double wanted = std::ceil(std::log2(error / allowed) / order);
    const auto factor = static_cast<std::size_t>(std::exp2(std::min(wanted, 10.0)));
    parts_ = std::min(parts_ * factor, kMostParts);
    now_ = start_;
    lastPart_ = lastPart;
    if (isLeapfrog) accelerations_[0] = startPush_;
    error = runParts();
  }
  before_ = start_;
  followedError_ += error;
  isKept_ = isKept_ && error <= allowed;
  spent_ += std::max(0.0, error - 0.5 * promise_.error * step_ / promise_.seconds);
  if (parts_ > 1 && error < 0.5 * allowed * std::exp2(-order)) parts_ /= 2;
  if (!hasMet()) return;
  metAt_ = time() + step_;
  integrator_ = JelloIntegrator::leapfrog;  // it keeps energy, at a quarter of the work
}

/// True if a wall or a ball pushes the jello.
bool JelloStepper::hasMet() const {
  if (std::ranges::any_of(touches_, &JelloTouch::isThere)) return true;
  const JelloSkin::Places at = places();
  return std::ranges::any_of(walls_, [&](const JelloWall& wall) {
    bool isBehind = false;
    for (std::size_t point = 0; point < world_.pointCount(); ++point) {
      const double height = wall.normal[0] * at[0][point] + wall.normal[1] * at[1][point] +
                            wall.normal[2] * at[2][point];
      isBehind = isBehind || height < wall.offset;
    }
    return isBehind;
  });
}

Status JelloStepper::advance() {
  if (promise_.error > 0.0 && std::isinf(metAt_)) {
    followStep();
  } else {
    beginTouches();
    part_ = step_;
    stepOnce();
  }
  if (hasBlownUp()) {
    std::swap(now_, before_);
    return Error{"jello: it blew up at " + std::to_string(time()) + " s, with " +
                 nameOf(integrator_) + " at steps of " + std::to_string(1e3 * step_) +
                 " ms; expected a smaller step, or backward_euler"};
  }
  for (std::size_t ball = 0; ball < touches_.size(); ++ball) {
    if (touchSizes_[ball] == 0.0) continue;
    touches_[ball].point /= touchSizes_[ball];
    touches_[ball].velocity /= touchSizes_[ball];
  }
  ++steps_;
  return std::monostate{};
}

JelloEnergy JelloStepper::energy() const {
  JelloEnergy energy;
  for (std::size_t index = 0; index < bodies(); ++index) {
    const double mass = 1.0 / inverseMass_[index];
    energy.kinetic += 0.5 * mass * at(3, index).squaredNorm();
    energy.gravity -= mass * world_.gravity.dot(at(0, index));
  }
  const auto press = [&](double depth) {
    if (depth > 0.0) energy.contact += 0.5 * world_.contact.stiffness * depth * depth;
  };
  const std::size_t walled = world_.ballsAreLed ? world_.pointCount() : bodies();
  for (const JelloWall& wall : walls_)
    for (std::size_t index = 0; index < walled; ++index)
      press(wall.offset - normalOf(wall).dot(at(0, index)) +
            (index < world_.pointCount() ? 0.0 : world_.balls[index - world_.pointCount()].radius));
  for (std::size_t ball = 0; ball < world_.balls.size(); ++ball) {
    const double radius = world_.balls[ball].radius;
    if (const auto contact = skin_.meet(places(), ballPosition(ball), radius))
      press(contact->depth);
    for (std::size_t other = 0; other < ball && !world_.ballsAreLed; ++other)
      press(radius + world_.balls[other].radius -
            (ballPosition(ball) - ballPosition(other)).norm());
  }
  forEachSpring(world_.lattice, [&](std::size_t a, std::size_t b, std::size_t which) {
    const double stretch = (position(a) - position(b)).norm() - springs_.lengths[which];
    energy.elastic += 0.5 * springs_.stiffness * stretch * stretch;
  });
  return energy;
}

Vec3 JelloStepper::jelloMomentum() const {
  Vec3 sum = Vec3::Zero();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double* speeds = now_.data() + (axis + 3) * stride() + kJelloSlack;
    for (std::size_t point = 0; point < world_.pointCount(); ++point)
      sum[static_cast<Eigen::Index>(axis)] += speeds[point];
  }
  return world_.lattice.pointMass * sum;
}

Vec3 JelloStepper::momentum() const {
  Vec3 sum = jelloMomentum();
  for (std::size_t ball = 0; ball < world_.balls.size(); ++ball)
    sum += world_.balls[ball].mass * ballVelocity(ball);
  return sum;
}

Vec3 JelloStepper::angularMomentum() const {
  Vec3 sum = Vec3::Zero();
  for (std::size_t index = 0; index < bodies(); ++index)
    sum += at(0, index).cross(at(3, index)) / inverseMass_[index];
  return sum;
}

Vec3 JelloStepper::centre() const {
  Vec3 sum = Vec3::Zero();
  for (std::size_t point = 0; point < world_.pointCount(); ++point)
    sum += position(point);
  return sum / static_cast<double>(world_.pointCount());
}

JelloSkin::Places JelloStepper::places() const {
  const double* first = now_.data() + kJelloSlack;
  return {first, first + stride(), first + 2 * stride()};
}

double JelloStepper::volume() const {
  return skin_.volume(places());
}

}  // namespace carom::native
