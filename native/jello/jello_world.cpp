#include "native/jello/jello_world.h"

#include <cmath>
#include <cstdlib>

namespace carom::native {
namespace {

bool isAbove(double value) {
  return std::isfinite(value) && value > 0.0;
}

bool isAtLeast(double value) {
  return std::isfinite(value) && value >= 0.0;
}

Status validate(const JelloLattice& lattice) {
  if (lattice.count < 2 || lattice.count > kMostJelloPoints)
    return Error{"the jello has " + std::to_string(lattice.count) +
                 " points along each axis; expected 2 to " + std::to_string(kMostJelloPoints)};
  if (!(lattice.size.allFinite() && lattice.size.minCoeff() > 0.0))
    return Error{"the size of the jello must be positive (m)"};
  if (!isAbove(lattice.pointMass)) return Error{"the mass of a point must be positive (kg)"};
  if (!isAtLeast(lattice.stiffness))
    return Error{"the stiffness of springs must be at least 0 (N/m)"};
  if (!isAtLeast(lattice.damping))
    return Error{"the damping of springs must be at least 0 (N s/m)"};
  return std::monostate{};
}

Status validate(const JelloField& field) {
  if (field.count == 0) return std::monostate{};
  if (field.forces.size() != field.count * field.count * field.count)
    return Error{"the force field has " + std::to_string(field.forces.size()) +
                 " forces; expected " + std::to_string(field.count) + "^3"};
  for (const Vec3& force : field.forces)
    if (!force.allFinite()) return Error{"a force of the field is not finite (N)"};
  if (field.count > 1 &&
      !((field.max - field.min).allFinite() && (field.max - field.min).minCoeff() > 0.0))
    return Error{"the box of the force field must have a size (m)"};
  return std::monostate{};
}

Status validatePlaces(const std::vector<Vec3>& points, const std::string& what,
                      std::size_t expected) {
  if (points.size() != expected)
    return Error{"the jello has " + std::to_string(points.size()) + " " + what + "; expected " +
                 std::to_string(expected)};
  for (std::size_t index = 0; index < points.size(); ++index)
    if (!points[index].allFinite())
      return Error{"number " + std::to_string(index) + " of the " + what + " is not finite"};
  return std::monostate{};
}

}  // namespace

const char* nameOf(JelloIntegrator integrator) {
  constexpr std::array<const char*, kJelloIntegrators> kNames = {
      "explicit_euler", "symplectic_euler", "midpoint", "rk4", "backward_euler", "leapfrog"};
  return kNames[static_cast<std::size_t>(integrator)];
}

int orderOf(JelloIntegrator integrator) {
  switch (integrator) {
    case JelloIntegrator::midpoint:
    case JelloIntegrator::leapfrog:
      return 2;
    case JelloIntegrator::rungeKutta4:
      return 4;
    default:
      return 1;
  }
}

const std::array<JelloSpring, kJelloSprings>& jelloSprings() {
  static const std::array<JelloSpring, kJelloSprings> springs = [] {
    std::array<JelloSpring, kJelloSprings> made;
    std::size_t next = 0;
    // True for one of each pair of opposite directions: the one that leads on in the order of the
    // points.
    const auto leadsOn = [](int x, int y, int z) {
      return x > 0 || (x == 0 && (y > 0 || (y == 0 && z > 0)));
    };
    made[next++] = {{2, 0, 0}};
    made[next++] = {{0, 2, 0}};
    // Springs that lead to one row along z are listed apart from each other: see simd_jello.cpp.
    for (const int z : {0, 1, -1})
      for (int x = 0; x <= 1; ++x)
        for (int y = -1; y <= 1; ++y)
          if (leadsOn(x, y, z)) made[next++] = {{x, y, z}};
    made[next++] = {{0, 0, 2}};
    return made;
  }();
  return springs;
}

std::vector<Vec3> restingPoints(const JelloLattice& lattice, const Vec3& middle,
                                const Quat& orientation) {
  std::vector<Vec3> points;
  const Vec3 spacing = lattice.size / static_cast<double>(lattice.count - 1);
  points.reserve(lattice.count * lattice.count * lattice.count);
  for (std::size_t i = 0; i < lattice.count; ++i) {
    for (std::size_t j = 0; j < lattice.count; ++j) {
      for (std::size_t k = 0; k < lattice.count; ++k) {
        const Vec3 place(static_cast<double>(i), static_cast<double>(j), static_cast<double>(k));
        points.emplace_back(middle +
                            orientation * (place.cwiseProduct(spacing) - 0.5 * lattice.size));
      }
    }
  }
  return points;
}

Status validate(const JelloWorld& world) {
  if (Status valid = validate(world.lattice); !valid) return valid;
  if (!isAtLeast(world.contact.stiffness) || !isAtLeast(world.contact.damping))
    return Error{"stiffness and damping of contacts must be at least 0 (N/m, N s/m)"};
  if (!world.gravity.allFinite()) return Error{"gravity must be finite (m/s^2)"};
  if (world.room && !((world.room->max - world.room->min).allFinite() &&
                      (world.room->max - world.room->min).minCoeff() > 0.0))
    return Error{"the room must have a size (m)"};
  for (const JelloPlane& plane : world.planes)
    if (!(std::abs(plane.normal.norm() - 1.0) < 1e-9) || !std::isfinite(plane.offset))
      return Error{"the normal of a plane must have length 1, and its offset be finite (m)"};
  for (const JelloBall& ball : world.balls)
    if (!isAbove(ball.radius) || !isAbove(ball.mass) || !ball.position.allFinite() ||
        !ball.velocity.allFinite())
      return Error{"radius and mass of ball " + std::to_string(ball.id) +
                   " must be positive (m, kg), its place and velocity finite"};
  if (Status valid = validate(world.field); !valid) return valid;
  if (Status valid = validatePlaces(world.positions, "positions", world.pointCount()); !valid)
    return valid;
  return validatePlaces(world.velocities, "velocities", world.pointCount());
}

}  // namespace carom::native
