#include "native/jello/jello_implicit.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>

namespace carom::native {
namespace {

/// Tolerance relative to the norm of the right side: far below the error of a step of first order.
constexpr double kSolverTolerance = 1e-12;

using Matrix = Eigen::Matrix3d;

}  // namespace

/// The matrix and the right side, assembled contact by contact. Stiffnesses are positive where they
/// pull back.
struct JelloImplicit::Parts {
  double step;
  const std::vector<Vec3>& velocities;
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd right;

  void block(std::size_t row, std::size_t column, const Matrix& value) {
    for (Eigen::Index i = 0; i < 3; ++i)
      for (Eigen::Index j = 0; j < 3; ++j)
        entries.emplace_back(static_cast<int>(3 * row) + static_cast<int>(i),
                             static_cast<int>(3 * column) + static_cast<int>(j), value(i, j));
  }
  void single(std::size_t a, const Matrix& stiffness, const Matrix& damping) {
    block(a, a, step * (damping + step * stiffness));
    right.segment<3>(static_cast<Eigen::Index>(3 * a)) -= step * step * stiffness * velocities[a];
  }
  /// Adds a spring and damper that hold the weighted mean of some bodies where it is.
  template <std::size_t kCount>
  void among(const std::array<std::size_t, kCount>& those,
             const std::array<double, kCount>& weights, const Matrix& stiffness,
             const Matrix& damping) {
    const Matrix both = step * (damping + step * stiffness);
    Vec3 velocity = Vec3::Zero();
    for (std::size_t one = 0; one < kCount; ++one)
      velocity += weights[one] * velocities[those[one]];
    const Vec3 push = step * step * stiffness * velocity;
    for (std::size_t one = 0; one < kCount; ++one) {
      for (std::size_t two = 0; two < kCount; ++two)
        block(those[one], those[two], weights[one] * weights[two] * both);
      right.segment<3>(static_cast<Eigen::Index>(3 * those[one])) -= weights[one] * push;
    }
  }
  void pair(std::size_t a, std::size_t b, const Matrix& stiffness, const Matrix& damping) {
    among<2>({a, b}, {1.0, -1.0}, stiffness, damping);
  }
};

void JelloImplicit::addContacts(const std::vector<Vec3>& positions, Parts& parts) const {
  const JelloWorld& world = step_.world;
  const auto [stiffness, damping] = world.contact;
  const std::size_t points = world.pointCount();
  const std::size_t walled = world.ballsAreLed ? points : positions.size();
  for (const JelloWall& wall : step_.walls) {
    const Vec3 normal(wall.normal[0], wall.normal[1], wall.normal[2]);
    for (std::size_t index = 0; index < walled; ++index) {
      const double radius = index < points ? 0.0 : world.balls[index - points].radius;
      if (normal.dot(positions[index]) < wall.offset + radius)
        parts.single(index, stiffness * normal * normal.transpose(),
                     damping * normal * normal.transpose());
    }
  }
  if (world.balls.empty()) return;
  std::array<std::vector<double>, 3> places;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t point = 0; point < points; ++point)
      places[axis].push_back(positions[point][static_cast<Eigen::Index>(axis)]);
  for (std::size_t ball = 0; ball < world.balls.size(); ++ball) {
    const double radius = world.balls[ball].radius;
    const auto contact = step_.skin.meet({places[0].data(), places[1].data(), places[2].data()},
                                         positions[points + ball], radius);
    if (contact) {
      const Matrix along = contact->normal * contact->normal.transpose();
      parts.among<4>({contact->points[0], contact->points[1], contact->points[2], points + ball},
                     {-contact->weights[0], -contact->weights[1], -contact->weights[2], 1.0},
                     stiffness * along, damping * along);
    }
    if (world.ballsAreLed) continue;
    for (std::size_t other = 0; other < ball; ++other) {
      const Vec3 away = positions[points + ball] - positions[points + other];
      const double distance = away.norm();
      if (!(distance > 0.0 && distance < radius + world.balls[other].radius)) continue;
      const Matrix along = away * away.transpose() / (distance * distance);
      parts.pair(points + ball, points + other, stiffness * along, damping * along);
    }
  }
}

Eigen::VectorXd JelloImplicit::velocityChange(const std::vector<Vec3>& positions,
                                              const std::vector<Vec3>& velocities,
                                              const Eigen::VectorXd& forces) const {
  Parts parts{step_.duration, velocities, {}, step_.duration * forces};
  for (std::size_t index = 0; index < positions.size(); ++index) {
    const double mass = index < step_.world.pointCount()
                            ? step_.world.lattice.pointMass
                            : step_.world.balls[index - step_.world.pointCount()].mass;
    parts.block(index, index, mass * Matrix::Identity());
  }
  forEachSpring(step_.world.lattice, [&](std::size_t a, std::size_t b, std::size_t which) {
    const Vec3 away = positions[a] - positions[b];
    const double length = away.norm();
    if (!(length > 0.0)) return;
    const Vec3 normal = away / length;
    const Matrix along = normal * normal.transpose();
    const double across = std::max(0.0, 1.0 - step_.springs.lengths[which] / length);
    parts.pair(a, b, step_.springs.stiffness * (along + across * (Matrix::Identity() - along)),
               step_.springs.damping * along);
  });
  addContacts(positions, parts);
  Eigen::SparseMatrix<double> matrix(forces.size(), forces.size());
  matrix.setFromTriplets(parts.entries.begin(), parts.entries.end());
  Eigen::ConjugateGradient<Eigen::SparseMatrix<double>, Eigen::Lower | Eigen::Upper> solver;
  solver.setTolerance(kSolverTolerance);
  solver.compute(matrix);
  return solver.solve(parts.right);
}

}  // namespace carom::native
