#include "tests/bench/native_yardstick.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace carom::bench {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kVolumeFraction = 0.3;

// Walls are numbered x low, x high, y low, and so on.
Eigen::Index axisOf(std::size_t wall) {
  return static_cast<Eigen::Index>(wall / 2);
}
bool isHigh(std::size_t wall) {
  return wall % 2 == 1;
}

}  // namespace

Gas makeGas(std::size_t count) {
  const auto number = static_cast<double>(count);
  Gas gas;
  gas.radius = 0.5;
  gas.side = std::cbrt(number * std::numbers::pi / 6.0 / kVolumeFraction);
  const auto perSide = static_cast<std::size_t>(std::ceil(std::cbrt(number) - 1e-9));
  const double spacing = gas.side / static_cast<double>(perSide);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> speed(-1.0, 1.0);
  for (std::size_t sphere = 0; sphere < count; ++sphere) {
    const Vec3 corner(static_cast<double>(sphere % perSide),
                      static_cast<double>(sphere / perSide % perSide),
                      static_cast<double>(sphere / (perSide * perSide)));
    gas.positions.emplace_back(spacing * (corner + Vec3::Constant(0.5)));
    Vec3& velocity = gas.velocities.emplace_back();
    for (double& component : velocity)
      component = speed(random);
  }
  return gas;
}

double kineticEnergy(const std::vector<Vec3>& velocities) {
  double energy = 0.0;
  for (const Vec3& velocity : velocities)
    energy += 0.5 * velocity.squaredNorm();
  return energy;
}

AllPairsGas::AllPairsGas(const Gas& gas)
    : side_(gas.side),
      radius_(gas.radius),
      positions_(gas.positions),
      velocities_(gas.velocities) {}

AllPairsGas::Collision AllPairsGas::next() {
  Collision first;
  double soonest = kNever;
  const std::size_t count = positions_.size();
  for (std::size_t sphere = 0; sphere < count; ++sphere) {
    for (std::size_t other = sphere + 1; other < count; ++other)
      look({sphere, other}, pairTime(sphere, other), first, soonest);
    for (std::size_t wall = 0; wall < 6; ++wall)
      look({sphere, count + wall}, wallTime(sphere, wall), first, soonest);
  }
  fly(soonest);
  collide(first);
  first.time = time_;
  return first;
}

void AllPairsGas::look(const Collision& candidate, double wait, Collision& first,
                       double& soonest) const {
  if (wait >= soonest) return;
  soonest = wait;
  first = candidate;
}

double AllPairsGas::pairTime(std::size_t sphere, std::size_t other) const {
  const Vec3 d = positions_[sphere] - positions_[other];
  const Vec3 v = velocities_[sphere] - velocities_[other];
  const double b = d.dot(v);
  if (b >= 0.0) return kNever;
  const double a = v.squaredNorm();
  const double c = d.squaredNorm() - 4.0 * radius_ * radius_;
  const double discriminant = b * b - a * c;
  if (discriminant < 0.0) return kNever;
  return std::max(0.0, c / (std::sqrt(discriminant) - b));
}

double AllPairsGas::wallTime(std::size_t sphere, std::size_t wall) const {
  const double position = positions_[sphere][axisOf(wall)];
  const double velocity = velocities_[sphere][axisOf(wall)];
  if (isHigh(wall) ? velocity <= 0.0 : velocity >= 0.0) return kNever;
  const double end = isHigh(wall) ? side_ - radius_ : radius_;
  return std::max(0.0, (end - position) / velocity);
}

void AllPairsGas::fly(double duration) {
  time_ += duration;
  for (std::size_t sphere = 0; sphere < positions_.size(); ++sphere)
    positions_[sphere] += duration * velocities_[sphere];
}

void AllPairsGas::collide(const Collision& collision) {
  const std::size_t count = positions_.size();
  Vec3& velocity = velocities_[collision.sphere];
  if (collision.partner >= count) {
    velocity[axisOf(collision.partner - count)] *= -1.0;
    return;
  }
  const Vec3 normal = (positions_[collision.sphere] - positions_[collision.partner]).normalized();
  Vec3& otherVelocity = velocities_[collision.partner];
  const Vec3 swapped = normal.dot(velocity - otherVelocity) * normal;
  velocity -= swapped;
  otherVelocity += swapped;
}

}  // namespace carom::bench
