#include "tests/bench/pointer_jello.h"

#include <array>

namespace carom::bench {

using namespace native;

PointerJello::PointerJello(const JelloWorld& world)
    : mass_(world.lattice.pointMass),
      stiffness_(world.lattice.stiffness),
      damping_(world.lattice.damping),
      gravity_(world.gravity) {
  for (std::size_t point = 0; point < world.pointCount(); ++point)
    points_.push_back({world.positions[point], world.velocities[point]});
  const std::vector<Vec3> rest = restingPoints(world.lattice, Vec3::Zero());
  forEachSpring(world.lattice, [&](std::size_t a, std::size_t b, std::size_t) {
    springs_.push_back({&points_[a], &points_[b], (rest[a] - rest[b]).norm()});
  });
}

void PointerJello::findForces() {
  for (Point& point : points_)
    point.force = mass_ * gravity_;
  for (const Spring& spring : springs_) {
    const Vec3 away = spring.a->position - spring.b->position;
    const double length = away.norm();
    const Vec3 along = away / length;
    const double speed = (spring.a->velocity - spring.b->velocity).dot(along);
    const Vec3 force = (-stiffness_ * (length - spring.length) - damping_ * speed) * along;
    spring.a->force += force;
    spring.b->force -= force;
  }
}

void PointerJello::step(double h) {
  const std::vector<Point> start = points_;
  std::vector<Point> sum = points_;
  constexpr std::array<double, 4> kAhead = {0.5, 0.5, 1.0, 0.0};
  constexpr std::array<double, 4> kWeight = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0};
  for (std::size_t stage = 0; stage < 4; ++stage) {
    findForces();
    for (std::size_t index = 0; index < points_.size(); ++index) {
      Point& point = points_[index];
      const Vec3 velocity = point.velocity;
      const Vec3 acceleration = point.force / mass_;
      sum[index].position += kWeight[stage] * h * velocity;
      sum[index].velocity += kWeight[stage] * h * acceleration;
      point.position = start[index].position + kAhead[stage] * h * velocity;
      point.velocity = start[index].velocity + kAhead[stage] * h * acceleration;
    }
  }
  for (std::size_t index = 0; index < points_.size(); ++index) {
    points_[index].position = sum[index].position;
    points_[index].velocity = sum[index].velocity;
  }
}

}  // namespace carom::bench
