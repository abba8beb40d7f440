#include "native/jello/jello_limits.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <vector>

#include <Eigen/Eigenvalues>

#include "native/jello/jello_kernels.h"

namespace carom::native {
namespace {

constexpr double kNoStep = 0.0;
constexpr double kAlways = std::numeric_limits<double>::infinity();
constexpr std::size_t kMostIterated = 24;  // points along an axis

/// Directions of the springs of each kind, at rest.
std::array<Vec3, kJelloSprings> directionsOf(const JelloLattice& lattice) {
  const Vec3 spacing = lattice.size / static_cast<double>(lattice.count - 1);
  std::array<Vec3, kJelloSprings> directions;
  for (std::size_t which = 0; which < kJelloSprings; ++which) {
    const auto& to = jelloSprings()[which].to;
    directions[which] = spacing.cwiseProduct(Vec3(to[0], to[1], to[2])).normalized();
  }
  return directions;
}

/// Largest eigenvalue of the stiffness matrix for springs of 1 N/m, by Lanczos's method from a
/// start that has a share of every mode.
double largestByIteration(const JelloLattice& lattice) {
  constexpr Eigen::Index kIterations = 120;
  const std::array<Vec3, kJelloSprings> directions = directionsOf(lattice);
  const auto size = static_cast<Eigen::Index>(3 * lattice.count * lattice.count * lattice.count);
  const auto times = [&](const Eigen::VectorXd& moved) {
    Eigen::VectorXd forces = Eigen::VectorXd::Zero(size);
    forEachSpring(lattice, [&](std::size_t a, std::size_t b, std::size_t which) {
      const auto first = static_cast<Eigen::Index>(3 * a);
      const auto second = static_cast<Eigen::Index>(3 * b);
      const Vec3& along = directions[which];
      const Vec3 force = along.dot(moved.segment<3>(first) - moved.segment<3>(second)) * along;
      forces.segment<3>(first) += force;
      forces.segment<3>(second) -= force;
    });
    return forces;
  };
  Eigen::VectorXd now(size);
  for (Eigen::Index index = 0; index < size; ++index)
    now[index] = std::sin(1.0 + 0.7 * static_cast<double>(index * index % 1009)) *
                 (index % 2 == 0 ? 1.0 : -1.0);
  now.normalize();
  Eigen::VectorXd before = Eigen::VectorXd::Zero(size);
  const Eigen::Index count = std::min(kIterations, size);
  Eigen::MatrixXd small = Eigen::MatrixXd::Zero(count, count);
  double link = 0.0;
  for (Eigen::Index index = 0; index < count; ++index) {
    Eigen::VectorXd next = times(now) - link * before;
    small(index, index) = now.dot(next);
    next -= small(index, index) * now;
    link = next.norm();
    if (index + 1 == count || link < 1e-12) break;
    small(index + 1, index) = small(index, index + 1) = link;
    before = now;
    now = next / link;
  }
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(small).eigenvalues().maxCoeff();
}

/// Largest eigenvalue of an endless lattice with springs of 1 N/m, over all plane waves, by their
/// phase from point to point. It is above that of any part of this lattice, whose springs are a
/// subset.
double largestOfWaves(const JelloLattice& lattice) {
  constexpr int kPhases = 32;
  const std::array<Vec3, kJelloSprings> directions = directionsOf(lattice);
  double largest = 0.0;
  for (int x = 0; x <= kPhases; ++x) {
    for (int y = 0; y <= kPhases; ++y) {
      for (int z = 0; z <= kPhases; ++z) {
        Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
        for (std::size_t which = 0; which < kJelloSprings; ++which) {
          const auto& to = jelloSprings()[which].to;
          const double phase =
              std::numbers::pi / kPhases * static_cast<double>(x * to[0] + y * to[1] + z * to[2]);
          sum += 2.0 * (1.0 - std::cos(phase)) * directions[which] * directions[which].transpose();
        }
        largest = std::max(
            largest, Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(sum, Eigen::EigenvaluesOnly)
                         .eigenvalues()[2]);
      }
    }
  }
  return largest;
}

/// Factor by which a step multiplies a motion that goes as exp(rate t), for a Runge-Kutta method
/// whose order is its number of stages.
double growth(std::complex<double> rate, double step, int order) {
  const std::complex<double> z = rate * step;
  std::complex<double> sum = 1.0;
  std::complex<double> term = 1.0;
  for (int power = 1; power <= order; ++power) {
    term *= z / static_cast<double>(power);
    sum += term;
  }
  return std::abs(sum);
}

/// Returns the largest step (s) at which `grows(step)` is false, up to where it first is true;
/// `fastest` is the fastest rate of the motion in 1/s.
template <typename Grows>
double largestBefore(double fastest, Grows grows) {
  double step = 1e-4 / fastest;
  if (grows(step)) return kNoStep;
  while (!grows(1.01 * step))
    step *= 1.01;
  double low = step;
  double high = 1.01 * step;
  for (int halving = 0; halving < 50; ++halving) {
    const double middle = 0.5 * (low + high);
    (grows(middle) ? high : low) = middle;
  }
  return low;
}

/// A step of leapfrog leads from place x, h v and h^2 a of the step before to new ones; with W =
/// w^2 h^2 and C = c h the characteristic polynomial of its matrix is z^3 + (W + 3 C / 2 - 2) z^2 +
/// (1 - 2 C) z + C / 2. It is stable while Jury's conditions hold.
double largestOfLeapfrog(double frequency, double damping) {
  const auto grows = [&](double step) {
    const double stretch = std::pow(frequency * step, 2);
    const double loss = damping * step;
    const double a2 = stretch + 1.5 * loss - 2.0;
    const double a1 = 1.0 - 2.0 * loss;
    const double a0 = 0.5 * loss;
    const bool isStable =
        1.0 - a2 + a1 - a0 >= 0.0 && a0 < 1.0 && std::abs(a1 - a0 * a2) <= 1.0 - a0 * a0;
    return !isStable;
  };
  return largestBefore(std::max(frequency, damping), grows);
}

double largestOfRungeKutta(double frequency, double damping, int order) {
  const std::complex<double> root =
      std::sqrt(std::complex<double>(0.25 * damping * damping - frequency * frequency));
  const std::complex<double> first = -0.5 * damping - root;
  const std::complex<double> second = -0.5 * damping + root;
  const auto grows = [&](double step) {
    return std::max(growth(first, step, order), growth(second, step, order)) > 1.0;
  };
  const double fastest = std::max(std::abs(first), std::abs(second));
  return largestBefore(fastest, grows);
}

/// Smallest of the largest steps over all oscillations up to the highest, w^2 = `largest`;
/// `damping(w^2)` is the damping of each.
template <typename Damping>
double smallest(JelloIntegrator integrator, double largest, Damping damping) {
  constexpr int kShares = 64;
  double step = kAlways;
  for (int share = 1; share <= kShares; ++share) {
    const double square = largest * std::pow(static_cast<double>(share) / kShares, 2);
    step = std::min(step, largestStep(integrator, std::sqrt(square), damping(square)));
  }
  return step;
}

/// Largest relative acceleration (1/kg) that a contact push gives to the two bodies between which
/// it acts; 0 without contacts.
double touchedBy(const JelloWorld& world) {
  double least = 0.0;
  if (world.room || !world.planes.empty()) least = 1.0 / world.lattice.pointMass;
  for (const JelloBall& ball : world.balls)
    least = std::max(least, 1.0 / world.lattice.pointMass + 1.0 / ball.mass);
  return least;
}

}  // namespace

double largestStep(JelloIntegrator integrator, double frequency, double damping) {
  const double square = frequency * frequency;
  switch (integrator) {
    case JelloIntegrator::explicitEuler: {
      const double overdamped = 0.25 * damping * damping - square;
      if (overdamped <= 0.0) return damping / square;
      return 2.0 / (0.5 * damping + std::sqrt(overdamped));
    }
    case JelloIntegrator::symplecticEuler:
      // The matrix of a step has trace 2 - c h - w^2 h^2 and determinant 1 - c h; both eigenvalues
      // are within 1 while the trace is at least -1 - determinant.
      return (std::sqrt(damping * damping + 4.0 * square) - damping) / square;
    case JelloIntegrator::midpoint:
      return damping > 0.0 ? largestOfRungeKutta(frequency, damping, 2) : kNoStep;
    case JelloIntegrator::rungeKutta4:
      return largestOfRungeKutta(frequency, damping, 4);
    case JelloIntegrator::backwardEuler:
      return kAlways;
    case JelloIntegrator::leapfrog:
      return largestOfLeapfrog(frequency, damping);
  }
  return kNoStep;
}

JelloLimits jelloLimits(const JelloWorld& world) {
  const JelloLattice& lattice = world.lattice;
  const double largest =
      lattice.count <= kMostIterated ? largestByIteration(lattice) : largestOfWaves(lattice);
  const double square = largest * lattice.stiffness / lattice.pointMass;
  const double touching = touchedBy(world);
  const double added = touching * world.contact.stiffness;
  JelloLimits limits;
  limits.highestFrequency = std::sqrt(square);
  limits.highestTouching = std::sqrt(square + added);
  const double damping = largest * lattice.damping / lattice.pointMass;
  const double addedDamping = touching * world.contact.damping;
  for (std::size_t which = 0; which < kJelloIntegrators; ++which) {
    const auto integrator = static_cast<JelloIntegrator>(which);
    limits.free[which] = square == 0.0 ? kAlways : smallest(integrator, square, [&](double part) {
      return damping * part / square;
    });
    limits.touching[which] = limits.free[which];
    if (added > 0.0)
      limits.touching[which] =
          std::min(limits.free[which],
                   largestStep(integrator, limits.highestTouching, damping + addedDamping));
  }
  return limits;
}

}  // namespace carom::native
