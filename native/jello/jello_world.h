#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "carom/audio/impulse_event.h"
#include "carom/audio/result.h"
#include "carom/audio/vector.h"

namespace carom::native {

/// Methods by which a jello is stepped.
enum class JelloIntegrator {
  explicitEuler,    ///< first order; gains energy unless damping takes it
  symplecticEuler,  ///< velocities first, then places by the new ones: first order, keeps energy
  midpoint,         ///< second-order Runge-Kutta method
  rungeKutta4,      ///< classic fourth-order Runge-Kutta method
  backwardEuler,    ///< one step of Newton's method: first order, stable, loses energy
  leapfrog          ///< half of the way, velocities, half of the way: second order, keeps energy
};

inline constexpr std::size_t kJelloIntegrators = 6;

/// "explicit_euler", "symplectic_euler", "midpoint", "rk4", "backward_euler" or "leapfrog". [any
/// thread]
const char* nameOf(JelloIntegrator integrator);

/// Order of convergence. [any thread]
int orderOf(JelloIntegrator integrator);

/// A lattice of mass points at the corners of boxes, each of the same mass, joined by springs: to
/// the next along each axis (structural), along the diagonals of faces and boxes (shear), and to
/// the next but one along each axis (bend). F = -k (|L| - R) L / |L| - d ((v . L) / |L|) L / |L|,
/// with the rest length R of the spring in an undeformed box.
struct JelloLattice {
  std::size_t count = 8;     ///< points along each axis, 2 to kMostJelloPoints
  Vec3 size = Vec3::Ones();  ///< m, > 0, size of the whole lattice at rest
  double pointMass = 1.0;    ///< kg, > 0, mass of each point
  double stiffness = 0.0;    ///< N/m, >= 0, of every spring
  double damping = 0.0;      ///< N s/m, >= 0, of every spring
};

inline constexpr std::size_t kMostJelloPoints = 128;

/// The penalty on a body beyond a surface: a push along the normal of k times the depth plus d
/// times the speed inwards. Never a pull.
struct JelloPenalty {
  double stiffness = 0.0;  ///< N/m, >= 0
  double damping = 0.0;    ///< N s/m, >= 0
};

/// A plane; points are on the side that its normal points to.
struct JelloPlane {
  BodyId id = 0;
  Vec3 normal = Vec3::UnitY();  ///< unit
  double offset = 0.0;          ///< m, the plane is { x : normal . x = offset }
};

/// A rigid ball that jello, planes and walls push by penalties.
struct JelloBall {
  BodyId id = 0;
  double radius = 0.0;           ///< m, > 0
  double mass = 0.0;             ///< kg, > 0
  Vec3 position = Vec3::Zero();  ///< m, at time 0
  Vec3 velocity = Vec3::Zero();  ///< m/s, at time 0
};

/// Forces on each point, given on a grid over a box, its corners included; trilinear between grid
/// points. Outside the box the force is that at its nearest point.
struct JelloField {
  std::size_t count = 0;     ///< grid points along each axis; 0: no field, 1: the same everywhere
  Vec3 min = Vec3::Zero();   ///< m
  Vec3 max = Vec3::Zero();   ///< m
  std::vector<Vec3> forces;  ///< N, count^3 of them, x outermost
};

struct JelloBox {
  Vec3 min = Vec3::Zero();  ///< m
  Vec3 max = Vec3::Zero();  ///< m
};

/// A jello and all that surrounds it, at time 0. Points are in order of x, y, z along the lattice,
/// z the fastest.
struct JelloWorld {
  BodyId id = 0;  ///< id of the jello
  JelloLattice lattice;
  JelloPenalty contact;
  Vec3 gravity = Vec3::Zero();   ///< m/s^2
  std::optional<JelloBox> room;  ///< if set, all bodies are inside it
  std::vector<JelloPlane> planes;
  JelloField field;
  std::vector<JelloBall> balls;
  /// If true, balls meet the jello only, and the caller steps them and sets their places:
  /// JelloStepper::setBall.
  bool ballsAreLed = false;
  std::vector<Vec3> positions;   ///< m, world frame, count^3
  std::vector<Vec3> velocities;  ///< m/s, world frame, count^3

  std::size_t pointCount() const { return lattice.count * lattice.count * lattice.count; }
};

/// Returns the points of an undeformed lattice, turned, then moved so that its centre is at
/// `middle`. [any thread]
std::vector<Vec3> restingPoints(const JelloLattice& lattice, const Vec3& middle,
                                const Quat& orientation = Quat::Identity());

/// Refuses a world that cannot be run; the message says what is wrong and what would be accepted.
/// [any thread]
Status validate(const JelloWorld& world);

/// Number of kinds of springs. A kind leads from a point to another, in points along x, y and z;
/// only one of each pair of opposite directions is listed.
inline constexpr std::size_t kJelloSprings = 16;
struct JelloSpring {
  std::array<int, 3> to{};
};
const std::array<JelloSpring, kJelloSprings>& jelloSprings();

/// Calls `visit(a, b, which)` for each spring of a lattice: points a and b, of kind `which` of
/// jelloSprings().
template <typename Visit>
void forEachSpring(const JelloLattice& lattice, Visit visit) {
  const auto n = static_cast<std::ptrdiff_t>(lattice.count);
  const auto isIn = [n](std::ptrdiff_t place) { return place >= 0 && place < n; };
  for (std::ptrdiff_t i = 0; i < n; ++i)
    for (std::ptrdiff_t j = 0; j < n; ++j)
      for (std::ptrdiff_t k = 0; k < n; ++k)
        for (std::size_t which = 0; which < kJelloSprings; ++which) {
          const auto& [x, y, z] = jelloSprings()[which].to;
          if (isIn(i + x) && isIn(j + y) && isIn(k + z))
            visit(static_cast<std::size_t>((i * n + j) * n + k),
                  static_cast<std::size_t>(((i + x) * n + j + y) * n + k + z), which);
        }
}

}  // namespace carom::native
