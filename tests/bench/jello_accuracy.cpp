#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <numbers>
#include <vector>

#include <Eigen/Eigenvalues>

#include "native/jello/jello_limits.h"
#include "native/jello/jello_stepper.h"
#include "scenes/run/jello_modes.h"
#include "tests/bench/table_program.h"
#include "tests/support/jello_stiffness.h"
#include "tests/support/random.h"

namespace carom::bench {

using namespace native;
using namespace scenes;

namespace {

constexpr const char* kHelp =
    "Prints jello against what theory says: orders of convergence, steps at which it blows up, "
    "error\n"
    "against run time, changes of momentum and energy, and the frequencies of small swings.\n"
    "With --short, fewer steps, fewer stiffnesses and fewer modes.\n";

constexpr std::array<JelloIntegrator, kJelloIntegrators> kAll = {
    JelloIntegrator::explicitEuler, JelloIntegrator::symplecticEuler, JelloIntegrator::midpoint,
    JelloIntegrator::rungeKutta4,   JelloIntegrator::backwardEuler,   JelloIntegrator::leapfrog};

/// A cube of 1 m and 1 kg, crumpled and turning, in free space.
JelloWorld crumpled(std::size_t count, double stiffness, double damping, double amplitude) {
  JelloWorld world;
  world.lattice.count = count;
  world.lattice.pointMass = 1.0 / static_cast<double>(world.pointCount());
  world.lattice.stiffness = stiffness;
  world.lattice.damping = damping;
  world.positions = restingPoints(world.lattice, Vec3::Zero());
  Random random(7);
  const double size = amplitude / static_cast<double>(count);
  for (Vec3& point : world.positions) {
    world.velocities.emplace_back(amplitude * (random.inCube() + Vec3(0.4, 1.1, 0.7).cross(point)));
    point += size * random.inCube();
  }
  return world;
}

JelloStepper stepperOf(const JelloWorld& world, JelloIntegrator integrator, double step) {
  Result<JelloStepper> stepper = JelloStepper::create(world, integrator, step);
  if (!stepper) std::abort();
  return *std::move(stepper);
}

/// Places after a run, and its cost; empty if the run blew up.
struct End {
  std::vector<Vec3> places;
  double cost = 0.0;  // s of CPU time
};

End ranFor(const JelloWorld& world, JelloIntegrator integrator, double step, double seconds) {
  JelloStepper stepper = stepperOf(world, integrator, step);
  const auto steps = std::lround(seconds / step);
  const std::clock_t before = std::clock();
  for (long index = 0; index < steps; ++index)
    if (!stepper.advance()) return {};
  End end;
  end.cost = static_cast<double>(std::clock() - before) / static_cast<double>(CLOCKS_PER_SEC);
  for (std::size_t point = 0; point < world.pointCount(); ++point)
    end.places.push_back(stepper.position(point));
  return end;
}

/// Root mean square of the distances (m).
double apart(const End& one, const End& other) {
  double sum = 0.0;
  for (std::size_t point = 0; point < one.places.size(); ++point)
    sum += (one.places[point] - other.places[point]).squaredNorm();
  return std::sqrt(sum / static_cast<double>(one.places.size()));
}

void printOrders(const Scale& scale) {
  const double duration = scale.of(0.064, 0.016);
  std::printf("orders of convergence, 5^3 points, %g s\n%-18s %10s %10s %10s %8s %8s\n", duration,
              "", "h, ms", "error, m", "at h/2", "order", "theory");
  const JelloWorld world = crumpled(5, 40.0, 0.005, 0.3);
  const End reference = ranFor(world, JelloIntegrator::rungeKutta4, 5e-6, duration);
  const std::array<double, kJelloIntegrators> steps = {1e-4, 1e-4, 5e-4, 1e-3, 1e-4, 5e-4};
  const std::array<double, kJelloIntegrators> theory = {1.0, 1.0, 2.0, 4.0, 1.0, 2.0};
  for (std::size_t which = 0; which < kAll.size(); ++which) {
    const double coarse = apart(ranFor(world, kAll[which], steps[which], duration), reference);
    const double fine = apart(ranFor(world, kAll[which], 0.5 * steps[which], duration), reference);
    std::printf("%-18s %10.3f %10.2e %10.2e %8.3f %8.0f\n", nameOf(kAll[which]), 1e3 * steps[which],
                coarse, fine, std::log2(coarse / fine), theory[which]);
  }
}

/// True if a tiny motion grows a millionfold in energy within so many steps.
bool grows(const JelloWorld& world, JelloIntegrator integrator, double step, int steps) {
  JelloStepper stepper = stepperOf(world, integrator, step);
  const double most = 1e6 * stepper.energy().total();
  for (int index = 0; index < steps; ++index) {
    if (!stepper.advance()) return true;
    if (index % 50 == 49 && stepper.energy().total() > most) return true;
  }
  return false;
}

void printLimits(const Scale& scale) {
  const int steps = scale.of(20000, 1000);
  const double stiffest = scale.of(2e6, 2.0);
  std::printf("\nlargest stable step, ms: predicted, and where it blows up; 4^3 points\n");
  std::printf("%-18s %8s", "damping, d w / k", "k, N/m");
  for (const JelloIntegrator integrator : kAll)
    std::printf(" %26s", nameOf(integrator));
  std::printf("\n");
  double worst = 0.0;
  for (const double ratio : {0.0, 0.2, 3.0}) {
    for (double stiffness = 1.0; stiffness < stiffest; stiffness *= 10.0) {
      JelloWorld world = crumpled(4, stiffness, 0.0, 1e-9);
      const double w = jelloLimits(world).highestFrequency;
      world.lattice.damping = ratio * stiffness / w;
      const JelloLimits limits = jelloLimits(world);
      std::printf("%-18.1f %8.0e", ratio, stiffness);
      for (std::size_t which = 0; which < kAll.size(); ++which) {
        const double predicted = limits.free[which];
        if (predicted == 0.0) {
          // By theory the oscillation grows at any step, but slowly.
          std::printf(" %12s %13s", "never",
                      grows(world, kAll[which], 1.0 / w, steps) ? "grows" : "none");
          continue;
        }
        if (std::isinf(predicted)) {
          std::printf(" %12s %13s", "any",
                      grows(world, kAll[which], 100.0 / w, steps) ? "blows up" : "none");
          continue;
        }
        double low = 0.5 * predicted;
        double high = 2.0 * predicted;
        for (int halving = 0; halving < 9; ++halving) {
          const double middle = 0.5 * (low + high);
          (grows(world, kAll[which], middle, steps) ? high : low) = middle;
        }
        std::printf(" %12.4g %13.4g", 1e3 * predicted, 1e3 * low);
        worst = std::max(worst, std::abs(low / predicted - 1.0));
      }
      std::printf("\n");
    }
  }
  std::printf("farthest from the prediction: %.1f %%\n", 100.0 * worst);
}

void printCosts(const Scale& scale) {
  std::printf("\nerror against run time: 8^3 points, 0.2 s, k = 200 N/m, d = 0.25 N s/m\n");
  std::printf("%-18s %10s %12s %12s\n", "", "h, ms", "seconds", "error, m");
  JelloWorld world = crumpled(8, 200.0, 0.25, 0.3);
  const End reference = ranFor(world, JelloIntegrator::rungeKutta4, scale.of(1e-5, 1e-4), 0.2);
  for (const JelloIntegrator integrator : kAll) {
    const bool isImplicit = integrator == JelloIntegrator::backwardEuler;
    const double least = scale.of(isImplicit ? 2e-3 : 2e-5, isImplicit ? 2e-2 : 4e-4);
    for (double step = isImplicit ? 0.05 : 2e-3; step > least; step *= 0.5) {
      const End end = ranFor(world, integrator, step, 0.2);
      if (end.places.empty())
        std::printf("%-18s %10.4f %12s %12s\n", nameOf(integrator), 1e3 * step, "-", "blew up");
      else
        std::printf("%-18s %10.4f %12.5f %12.2e\n", nameOf(integrator), 1e3 * step, end.cost,
                    apart(end, reference));
    }
  }
}

void printBooks(const Scale& scale) {
  const int steps = scale.of(10000, 1000);
  std::printf(
      "\nconservation over %g s, 5^3 points, steps of 0.2 ms: change of momentum and angular "
      "momentum\n"
      "beside their first value, of energy without damping, largest growth in a step with it\n",
      2e-4 * steps);
  std::printf("%-18s %12s %12s %12s %12s\n", "", "momentum", "angular", "energy", "growth");
  for (const JelloIntegrator integrator : kAll) {
    if (integrator == JelloIntegrator::explicitEuler) continue;  // unstable at that step
    std::array<double, 4> changes{};
    for (const double damping : {0.0, 0.01}) {
      JelloStepper stepper = stepperOf(crumpled(5, 40.0, damping, 0.3), integrator, 2e-4);
      const Vec3 momentum = stepper.momentum();
      const Vec3 turning = stepper.angularMomentum();
      const double energy = stepper.energy().total();
      double before = energy;
      for (int index = 0; index < steps; ++index) {
        if (!stepper.advance()) break;
        const double now = stepper.energy().total();
        if (damping > 0.0) changes[3] = std::max(changes[3], now / before - 1.0);
        before = now;
      }
      if (damping > 0.0) continue;
      changes[0] = (stepper.momentum() - momentum).norm() / momentum.norm();
      changes[1] = (stepper.angularMomentum() - turning).norm() / turning.norm();
      changes[2] = before / energy - 1.0;
    }
    std::printf("%-18s %12.1e %12.1e %12.1e %12.1e\n", nameOf(integrator), changes[0], changes[1],
                changes[2], changes[3]);
  }
}

/// Releases each mode by itself from a displacement of a millionth and measures its period.
void printModes(const Scale& scale) {
  JelloWorld world = crumpled(6, 20000.0, 0.0, 0.0);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> modes(test::stiffnessOf(world.lattice) /
                                                             world.lattice.pointMass);
  const auto model = jelloModalModel(world.lattice);
  if (!model || model->leftOut.below > 0 || model->modes.size() < 10) {
    std::printf("the lattice has no ten modes above 20 Hz\n");
    return;
  }
  std::printf(
      "\nsmall swings, 6^3 points: modes by jelloModalModel, and what the direct run swings at\n"
      "%8s %14s %14s %12s\n",
      "mode", "modal, Hz", "direct, Hz", "error, %");
  for (Eigen::Index mode = 6; mode < scale.of(16, 8); ++mode) {
    const double expected = model->modes[static_cast<std::size_t>(mode - 6)].frequency;
    const Eigen::VectorXd shape = modes.eigenvectors().col(mode);
    JelloWorld moved = world;
    for (std::size_t point = 0; point < world.pointCount(); ++point)
      moved.positions[point] += 1e-6 * shape.segment<3>(static_cast<Eigen::Index>(3 * point));
    const double step = 1.0 / (200.0 * expected);
    JelloStepper stepper = stepperOf(moved, JelloIntegrator::rungeKutta4, std::min(step, 5e-4));
    // Zero crossings, interpolated linearly between steps.
    double before = 1.0;
    double first = 0.0;
    double last = 0.0;
    int crossings = 0;
    while (crossings < 41) {
      if (!stepper.advance()) return;
      double now = 0.0;
      for (std::size_t point = 0; point < world.pointCount(); ++point)
        now += shape.segment<3>(static_cast<Eigen::Index>(3 * point))
                   .dot(stepper.position(point) - world.positions[point]);
      now *= 1e6;
      if ((before < 0.0) != (now < 0.0)) {
        last = stepper.time() - stepper.step() * now / (now - before);
        if (crossings == 0) first = last;
        ++crossings;
      }
      before = now;
    }
    const double found = 20.0 / (last - first);
    std::printf("%8d %14.5f %14.5f %12.5f\n", static_cast<int>(mode) - 5, expected, found,
                100.0 * (found / expected - 1.0));
  }
}

int run(const Scale& scale) {
  printOrders(scale);
  printLimits(scale);
  printCosts(scale);
  printBooks(scale);
  printModes(scale);
  return 0;
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  return carom::bench::TableProgram{"bench_jello_accuracy", carom::bench::kHelp, carom::bench::run}
      .main(argc, argv);
}
