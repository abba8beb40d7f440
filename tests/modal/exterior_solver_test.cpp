#include "modal/radiation/exterior_solver.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <numbers>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/audio/meshes.h"
#include "tests/modal/ringing_models.h"
#include "tests/support/constants.h"
#include "tests/support/special_functions.h"

namespace carom::test {

using namespace audio;
using namespace modal;

namespace {

using Complex = std::complex<double>;

// h_n^(2) and its derivative, from the standard library's Bessel functions.
Complex hankel(int n, double z) {
  const auto order = static_cast<unsigned>(n);
  return {test::sphericalBessel(order, z), -test::sphericalNeumann(order, z)};
}

Complex hankelSlope(int n, double z) {
  return n / z * hankel(n, z) - hankel(n + 1, z);
}

double legendre(int n, double x) {
  return test::legendrePolynomial(static_cast<unsigned>(n), x);
}

// Root mean square error of u, relative to u, on a unit sphere whose slope is P_n(cos theta).
double errorOnSphere(const ExteriorSolver& solver, int n, double ka) {
  Eigen::VectorXcd slope(std::ssize(solver.panels()));
  for (Eigen::Index panel = 0; panel < slope.size(); ++panel)
    slope[panel] =
        legendre(n, solver.panels()[static_cast<std::size_t>(panel)].centroid().normalized().z());
  const Complex impedance = hankel(n, ka) / (ka * hankelSlope(n, ka));
  return (solver.solve(ka, slope) - impedance * slope).norm() / (impedance * slope).norm();
}

ExteriorSolver sphereSolver(int splits) {
  return ExteriorSolver(ellipsoidMesh(Vec3::Ones(), splits));
}

TEST(ExteriorSolver, SphereIsTheClosedFormAlsoAtResonancesOfTheInside) {
  const ExteriorSolver sphere = sphereSolver(3);
  for (int n = 0; n <= 2; ++n) {
    EXPECT_LT(errorOnSphere(sphere, n, 0.1), 0.02) << n;
    EXPECT_LT(errorOnSphere(sphere, n, 4.0), 0.02) << n;
  }
  EXPECT_LT(errorOnSphere(sphere, 0, kPi), 0.02);     // the first zero of j_0
  EXPECT_LT(errorOnSphere(sphere, 1, 4.4934), 0.02);  // the first zero of j_1
}

TEST(ExteriorSolver, FinerPanelsAreNearer) {
  for (const int n : {0, 2}) {
    const double coarse = errorOnSphere(sphereSolver(2), n, 1.0);
    EXPECT_LT(errorOnSphere(sphereSolver(3), n, 1.0), 0.6 * coarse) << n << " " << coarse;
  }
}

TEST(ExteriorSolver, PointsInsideJoinInBeforeTheFirstResonanceAndNotInThinBodies) {
  const ExteriorSolver ball(ellipsoidMesh(Vec3::Ones(), 2));
  EXPECT_FALSE(ball.usesInteriorPoints(1.0));
  EXPECT_TRUE(ball.usesInteriorPoints(2.5));
  const ExteriorSolver plate(splitMesh(splitMesh(boxMesh({1.0, 1.0, 0.01}))));
  EXPECT_FALSE(plate.usesInteriorPoints(20.0));
}

// A point source inside a body: its field outside is known whatever the body's shape.
struct Source {
  Vec3 at;
  double strength;
};

struct Boundary {
  Eigen::VectorXcd value;
  Eigen::VectorXcd slope;
};

Boundary boundaryOf(const ExteriorSolver& solver, const std::vector<Source>& sources, double k) {
  const auto count = std::ssize(solver.panels());
  Boundary boundary{Eigen::VectorXcd::Zero(count), Eigen::VectorXcd::Zero(count)};
  for (Eigen::Index row = 0; row < count; ++row) {
    const SourcePanel& panel = solver.panels()[static_cast<std::size_t>(row)];
    for (const Source& source : sources) {
      const Vec3 away = panel.centroid() - source.at;
      const double r = away.norm();
      const Complex field = source.strength * std::polar(1.0 / r, -k * r);
      boundary.value[row] += field;
      boundary.slope[row] += field * Complex(-1.0 / r, -k) * away.dot(panel.normal()) / r;
    }
  }
  return boundary;
}

double errorAround(const ExteriorSolver& solver, const std::vector<Source>& sources, double k) {
  const Boundary boundary = boundaryOf(solver, sources, k);
  return (solver.solve(k, boundary.slope) - boundary.value).norm() / boundary.value.norm();
}

TEST(ExteriorSolver, PointSourceInABoxIsFoundOnItsFaces) {
  const ExteriorSolver box(splitMesh(splitMesh(splitMesh(boxMesh({0.1, 0.07, 0.05})))));
  const std::vector<Source> sources = {{Vec3(0.02, 0.01, -0.01), 1.0}};
  EXPECT_LT(errorAround(box, sources, 1.0), 0.01);
  EXPECT_LT(errorAround(box, sources, 20.0), 0.02);
  EXPECT_LT(errorAround(box, sources, 42.0), 0.03);  // the inside resonates at 42.02
}

// The bar is 20 times as long as thick, and its panels are twice as long as wide.
TEST(ExteriorSolver, LineOfSourcesInASlenderBarIsFoundOnItsSides) {
  std::vector<Source> even;
  std::vector<Source> alternating;
  for (int step = 0; step < 200; ++step) {
    const double x = 0.18 * (2.0 * (step + 0.5) / 200.0 - 1.0);
    const double taper = std::pow(std::cos(0.5 * kPi * x / 0.18), 2.0);
    even.push_back({Vec3(x, 0, 0), taper});
    alternating.push_back({Vec3(x, 0, 0), taper * std::sin(2.5 * kPi * x / 0.18)});
  }
  const ExteriorSolver bar(splitMesh(barMesh({0.2, 0.01, 0.01}, 24, 4)));
  EXPECT_LT(errorAround(bar, even, 40.0), 0.02);
  EXPECT_LT(errorAround(bar, alternating, 1.0), 0.02);
  EXPECT_LT(errorAround(bar, alternating, 40.0), 0.02);
}

Eigen::VectorXcd someMotion(const ExteriorSolver& solver, const Vec3& wave) {
  Eigen::VectorXcd slope(std::ssize(solver.panels()));
  for (Eigen::Index row = 0; row < slope.size(); ++row)
    slope[row] =
        std::cos(wave.dot(solver.panels()[static_cast<std::size_t>(row)].centroid()) + 0.3);
  return slope;
}

Eigen::VectorXd areasOf(const ExteriorSolver& solver) {
  Eigen::VectorXd areas(std::ssize(solver.panels()));
  for (Eigen::Index row = 0; row < areas.size(); ++row)
    areas[row] = solver.panels()[static_cast<std::size_t>(row)].area();
  return areas;
}

// The effect of one motion on another equals that of the other on it; a plate that is thinner than
// its panels is the hard case.
TEST(ExteriorSolver, IsReciprocal) {
  for (const Vec3& half : {Vec3(0.1, 0.07, 0.05), Vec3(0.1, 0.1, 0.002)}) {
    const ExteriorSolver solver(splitMesh(splitMesh(splitMesh(boxMesh(half)))));
    const Eigen::VectorXcd first = someMotion(solver, {20, 5, 300});
    const Eigen::VectorXcd second = someMotion(solver, {-15, 30, 200});
    const Eigen::VectorXd areas = areasOf(solver);
    const auto onto = [&](const Eigen::VectorXcd& cause, const Eigen::VectorXcd& other) {
      return (solver.solve(25.0, cause).array() * other.array() * areas.array()).sum();
    };
    const Complex there = onto(first, second);
    const Complex back = onto(second, first);
    EXPECT_LT(std::abs(there - back), 0.02 * std::abs(there)) << half.z();
  }
}

// Sums and multiples of motions sound as the sums and multiples of their sounds, which holds to the
// last digits only if the equations are solved that far: without points inside and with them, and
// however large the motion is.
TEST(ExteriorSolver, IsLinearToTenDigits) {
  const ExteriorSolver solver(splitMesh(splitMesh(boxMesh({0.1, 0.07, 0.05}))));
  const Eigen::VectorXcd first = someMotion(solver, {20, 5, 30});
  const Eigen::VectorXcd second = someMotion(solver, {-15, 30, 20});
  for (const double k : {1.0, 20.0, 42.0}) {
    const Eigen::VectorXcd whole = solver.solve(k, first + 1e-3 * second);
    const Eigen::VectorXcd parts = solver.solve(k, first) + 1e-3 * solver.solve(k, second);
    EXPECT_LT((whole - parts).norm(), 1e-9 * whole.norm()) << k;
    for (const double size : {1e-60, 1e60})
      EXPECT_LT((solver.solve(k, size * first) / size - solver.solve(k, first)).norm(),
                1e-9 * whole.norm())
          << k << " " << size;
    EXPECT_EQ(solver.solve(k, 0.0 * first).norm(), 0.0);
  }
  EXPECT_TRUE(solver.usesInteriorPoints(42.0));
  EXPECT_FALSE(solver.usesInteriorPoints(1.0));
}

// The power at the surface, Im integral conj(du/dn) u dS, is compared with k times the integral of
// |r u|^2 over all directions far away.
TEST(ExteriorSolver, PowerThatLeavesTheSurfaceArrivesFarAway) {
  const double k = 20.0;
  const ExteriorSolver solver(splitMesh(splitMesh(boxMesh({0.1, 0.07, 0.05}))));
  const Eigen::VectorXcd slope = someMotion(solver, {20, 5, 30});
  const Eigen::VectorXcd value = solver.solve(k, slope);
  const Eigen::VectorXd areas = areasOf(solver);
  const double leaving = (slope.array().conjugate() * value.array() * areas.array()).sum().imag();
  double arriving = 0.0;
  const int directions = 400;
  for (int spot = 0; spot < directions; ++spot) {  // evenly over the sphere, along a spiral
    const double z = 1.0 - (2.0 * spot + 1.0) / directions;
    const double turn = kPi * (3.0 - std::sqrt(5.0)) * spot;
    const Vec3 d(std::sqrt(1 - z * z) * std::cos(turn), std::sqrt(1 - z * z) * std::sin(turn), z);
    Complex field = 0.0;
    for (Eigen::Index row = 0; row < slope.size(); ++row) {
      const SourcePanel& panel = solver.panels()[static_cast<std::size_t>(row)];
      field += areas[row] * std::polar(1.0, k * d.dot(panel.centroid())) *
               (Complex(0.0, k * d.dot(panel.normal())) * value[row] - slope[row]);
    }
    arriving += k * std::norm(field / (4.0 * kPi)) * 4.0 * kPi / directions;
  }
  EXPECT_NEAR(arriving / leaving, 1.0, 0.02);
}

}  // namespace
}  // namespace carom::test
