#include "tests/support/direct_contact.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <numbers>
#include <utility>

#include <Eigen/Eigenvalues>
#include <Eigen/SparseCholesky>

#include "carom/modal/analysis_settings.h"
#include "modal/analysis/eigen_solver.h"
#include "modal/analysis/shell_model.h"
#include "modal/analysis/solid_model.h"

namespace carom::test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Matrix = Eigen::SparseMatrix<double>;
using Factor = Eigen::SimplicialLDLT<Matrix>;

constexpr Index kDenseRows = 1000;  // up to which all modes are found
constexpr Index kMostModes = 300;   // of a larger body
constexpr Index kRigidModes = 6;

template <class T>
T wanted(Result<T> result) {
  if (!result) std::abort();
  return *std::move(result);
}

// A newton on the patch, spread evenly, at a depth (m) below it.
VectorXd spreadOver(const modal::SplineMesh& grid, const Patch& patch, double depth) {
  constexpr int kRings = 3;
  constexpr int kAngles = 12;
  const Vec3 side = patch.inward.unitOrthogonal();
  const Vec3 other = patch.inward.cross(side);
  VectorXd push = VectorXd::Zero(3 * std::ssize(grid.nodes));
  for (int ring = 0; ring < kRings; ++ring) {
    const double radius = patch.radius * (ring + 0.5) / kRings;
    const double share = (2.0 * ring + 1.0) / (kRings * kRings * kAngles);
    for (int spoke = 0; spoke < kAngles; ++spoke) {
      const double angle = 2.0 * std::numbers::pi * spoke / kAngles;
      const Vec3 at = patch.centre + depth * patch.inward +
                      radius * (std::cos(angle) * side + std::sin(angle) * other);
      const modal::CellPoint point = modal::locate(grid, at);
      for (std::size_t function = 0; function < point.weights.size(); ++function) {
        const std::uint32_t node = grid.cells[point.cell].nodes[function];
        push.segment<3>(3 * static_cast<Index>(node)) +=
            share * point.weights[function] * patch.inward;
      }
    }
  }
  return push;
}

// The same, all through the wall.
VectorXd spreadThrough(const modal::SplineMesh& grid, const Patch& patch) {
  constexpr int kDepths = 5;
  VectorXd push = VectorXd::Zero(3 * std::ssize(grid.nodes));
  for (int layer = 0; layer < kDepths; ++layer)
    push += spreadOver(grid, patch, patch.wall * (layer + 0.5) / kDepths) / kDepths;
  return push;
}

struct Eigenmodes {
  VectorXd lambda;  // rad^2/s^2
  MatrixXd shapes;
};

Eigenmodes lowest(const PatchedBody& body, double highest) {
  const double bound = std::pow(2.0 * std::numbers::pi * highest, 2);
  if (body.mass.rows() <= kDenseRows) {
    const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solver(MatrixXd(body.stiffness),
                                                                    MatrixXd(body.mass));
    const VectorXd& lambda = solver.eigenvalues();
    const Index count = std::ranges::upper_bound(lambda, bound) - lambda.begin();
    return {lambda.head(count), solver.eigenvectors().leftCols(count)};
  }
  modal::EigenSettings settings;
  settings.modes = kMostModes;
  settings.highest = bound;
  const modal::EigenSolution found =
      wanted(modal::lowestModes(body.stiffness, body.mass, settings));
  if (!found.counted || found.below > found.lambda.size()) std::abort();
  const Index count = std::ranges::upper_bound(found.lambda, bound) - found.lambda.begin();
  return {found.lambda.head(count), found.vectors.leftCols(count)};
}

// A force and a shift at which modes count as static, other than rigid ones.
VectorXd yieldOf(const PatchedBody& body, double shift, const VectorXd& force) {
  const Matrix shifted = body.stiffness + shift * body.mass;
  return Factor(shifted).solve(force);
}

// The contact's law, and by how much less deep a step ends for each newton.
class ContactLaw {
 public:
  struct Step {
    double depth = 0.0;   // m, at its end, without a force
    double rate = 0.0;    // m/s, likewise
    double length = 0.0;  // s
  };

  ContactLaw(const DirectBlow& blow, double dent, double yield)
      : blow_(blow), dent_(dent), yield_(yield) {}

  double depth(const Step& step, double force) const {
    return step.depth + (dent_ - yield_) * force;
  }
  double potential(double depth) const {
    return depth > 0.0 ? 0.4 * blow_.stiffness * std::pow(depth, 2.5) : 0.0;
  }
  // The force at the end of a step, by bisection.
  double force(const Step& step) const {
    double low = 0.0;
    double high = std::max(lawAt(step, 0.0), 0.0);
    if (high == 0.0) return 0.0;
    while (lawAt(step, high) > high)
      high *= 2.0;
    for (int halving = 0; halving < 60; ++halving) {
      const double middle = 0.5 * (low + high);
      (lawAt(step, middle) > middle ? low : high) = middle;
    }
    return 0.5 * (low + high);
  }

 private:
  double lawAt(const Step& step, double force) const {
    const double deep = depth(step, force);
    if (deep <= 0.0) return 0.0;
    const double rate = step.rate - 2.0 / step.length * yield_ * force;  // but for the dent's
    return std::max(blow_.stiffness * std::pow(deep, 1.5) * (1.0 + blow_.damping * rate), 0.0);
  }

  const DirectBlow& blow_;
  double dent_;   // m/N
  double yield_;  // m/N
};

}  // namespace

PatchedBody patchedSolid(const SurfaceMesh& surface, const Material& material,
                         std::size_t degreesOfFreedom, const Patch& patch) {
  GridSettings settings;
  settings.degreesOfFreedom = degreesOfFreedom;
  modal::SolidSystem system = wanted(modal::solidSystem(surface, material, settings));
  PatchedBody body{.mass = system.mass,
                   .stiffness = system.stiffness,
                   .beta = material.dampingBeta,
                   .push = spreadOver(system.grid, patch, 0.0)};
  const double size = (system.grid.nodes.front() - system.grid.nodes.back()).norm();
  const double slow = material.youngsModulus / material.density / (size * size);
  const VectorXd yield = yieldOf(body, slow, body.push);
  body.dent = (body.push - spreadThrough(system.grid, patch)).dot(yield);
  return body;
}

PatchedBody patchedShell(const SurfaceMesh& surface, const Material& material, const Patch& patch) {
  ShellSettings settings;
  settings.thickness = patch.wall;
  settings.springs = ShellSprings::axial;
  settings.minVertices = 50;
  const modal::ShellNetwork network = wanted(modal::shellNetwork(surface, material, settings));
  PatchedBody body{.stiffness = network.stiffness, .beta = material.dampingBeta};
  VectorXd masses(network.stiffness.rows());
  body.push = VectorXd::Zero(masses.size());
  double sum = 0.0;
  for (std::size_t vertex = 0; vertex < network.surface.vertices.size(); ++vertex) {
    const auto row = 3 * static_cast<Index>(vertex);
    masses.segment<3>(row).setConstant(network.masses[static_cast<Index>(vertex)]);
    const double away = (network.surface.vertices[vertex] - patch.centre).norm() / patch.radius;
    const double weight = std::max(1.0 - away * away, 0.0);
    body.push.segment<3>(row) = weight * patch.inward;
    sum += weight;
  }
  body.push /= sum;
  body.mass = masses.asDiagonal().toDenseMatrix().sparseView();
  return body;
}

PatchModes modesOf(const PatchedBody& body, double highest) {
  const Eigenmodes found = lowest(body, highest);
  PatchModes patch{.rigid = found.shapes.leftCols(kRigidModes)};
  const VectorXd along = found.shapes.transpose() * body.push;
  patch.mobility = along.head(kRigidModes).squaredNorm();
  // At this shift nothing above the highest mode moves by inertia.
  const double shift = found.lambda[kRigidModes];
  patch.beyond =
      body.push.dot(yieldOf(body, shift, body.push)) - patch.mobility / shift - body.dent;
  for (Index mode = kRigidModes; mode < found.lambda.size(); ++mode) {
    const double square = found.lambda[mode];
    const double decay = 0.5 * body.beta * square;
    if (decay * decay >= square) continue;
    patch.modes.push_back(
        {.frequency = std::sqrt(square - decay * decay), .decay = decay, .shape = along[mode]});
    patch.beyond -= along[mode] * along[mode] / (square + shift);
  }
  return patch;
}

DirectCourse integrate(const PatchedBody& body, const PatchModes& modes, const DirectBlow& blow,
                       double step, double until) {
  const double half = 0.5 * step;
  const Matrix matrix = body.mass + half * (half + body.beta) * body.stiffness;
  const Factor factor(matrix);
  const VectorXd pushed = factor.solve(body.push);
  const double yield = half * half * (body.push.dot(pushed) + 1.0 / blow.mass);
  const ContactLaw law(blow, body.dent, yield);
  VectorXd u = VectorXd::Zero(body.push.size());
  VectorXd v = u;
  VectorXd a = u;
  double approach = 0.0;  // of the ball
  double speed = blow.speed;
  double depth = 0.0;
  DirectCourse course{.step = step, .force = {0.0}};
  double lost = 0.0;
  const MatrixXd momenta = body.mass * modes.rigid;
  const VectorXd rigidPush = modes.rigid.transpose() * body.push;
  const double effective = 1.0 / (modes.mobility + 1.0 / blow.mass);
  const auto close = [&] {
    const VectorXd rigid = momenta.transpose() * v;
    const double relative = speed - rigidPush.dot(rigid);
    course.rigid = 0.5 * effective * relative * relative;
    course.modes = 0.5 * (v.dot(body.mass * v) + u.dot(body.stiffness * u) - rigid.squaredNorm());
    course.lost = lost + law.potential(depth);  // of a lossy contact that lets go of a dent
  };
  const auto steps = static_cast<std::size_t>(std::ceil(until / step));
  for (std::size_t n = 0; n < steps; ++n) {
    const double before = course.force.back();
    const double ball = blow.gravity - before / blow.mass;  // m/s^2
    u += step * v + half * half * a;
    v += half * a;
    a = factor.solve(-(body.stiffness * (u + body.beta * v))).eval();
    const double free = approach + step * speed + half * half * (ball + blow.gravity) -
                        body.push.dot(u + half * half * a);
    const double rate = speed + half * (ball + blow.gravity) - body.push.dot(v + half * a);
    const ContactLaw::Step next{free, rate, step};
    const double force = law.force(next);
    a += force * pushed;
    u += half * half * a;
    v += half * a;
    approach += step * speed + half * half * (ball + blow.gravity - force / blow.mass);
    speed += half * (ball + blow.gravity - force / blow.mass);
    const double deep = law.depth(next, force);
    lost += 0.5 * (force + before) * (deep - depth) - law.potential(deep) + law.potential(depth);
    depth = deep;
    course.deepest = std::max(course.deepest, depth);
    course.force.push_back(force);
    if (before == 0.0 && force > 0.0) ++course.touches;
    if (before > 0.0 && force == 0.0) close();
  }
  if (course.force.back() > 0.0) close();
  return course;
}

}  // namespace carom::test
