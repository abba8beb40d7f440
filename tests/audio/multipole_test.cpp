#include "audio/radiation/multipole.h"

#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "tests/audio/meshes.h"
#include "tests/support/constants.h"
#include "tests/support/no_alloc_scope.h"
#include "tests/support/special_functions.h"

namespace carom {

using namespace audio;

namespace {

using namespace test;

using Complex = std::complex<double>;

// The oracle: harmonics from the standard library's Legendre functions, which have the
// Condon-Shortley phase; its arguments are angles, not coordinates.
double harmonic(int l, int m, double theta, double phi) {
  const int size = std::abs(m);
  const double legendre =
      test::sphericalLegendre(static_cast<unsigned>(l), static_cast<unsigned>(size), theta);
  if (m == 0) return legendre;
  const double sign = size % 2 == 0 ? 1.0 : -1.0;
  return sign * std::numbers::sqrt2 * legendre * (m > 0 ? std::cos(m * phi) : std::sin(size * phi));
}

Vec3 toward(double theta, double phi) {
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

// h_l^(2) from the standard library's Bessel functions.
Complex hankel(int l, double z) {
  const auto order = static_cast<unsigned>(l);
  return {test::sphericalBessel(order, z), -test::sphericalNeumann(order, z)};
}

Complex iToThe(int power) {
  const Complex powers[] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
  return powers[((power % 4) + 4) % 4];
}

// Multipoles about the origin of a point source at (radius, theta, phi), p = exp(-i k R) / R, by
// the addition theorem of the spherical Hankel function (Abramowitz and Stegun 10.1.45 and 46).
ModeRadiation pointSourceAt(double radius, double theta, double phi, double k, int order) {
  ModeRadiation radiation;
  for (int l = 0; l <= order; ++l)
    for (int m = -l; m <= l; ++m)
      radiation.multipoles.push_back(4.0 * kPi * iToThe(l) *
                                     test::sphericalBessel(static_cast<unsigned>(l), k * radius) *
                                     harmonic(l, m, theta, phi));
  return radiation;
}

TEST(SphericalHarmonics, AreThoseOfTheStandardLibraryInTheStatedOrder) {
  for (const auto& [theta, phi] : {std::pair(0.3, 0.2), std::pair(1.5, -2.0), std::pair(2.9, 4.0),
                                   std::pair(0.0, 0.0), std::pair(kPi, 0.0)}) {
    const DirectionHarmonics harmonics(3.0 * toward(theta, phi));
    for (int l = 0; l <= kHighestMultipole; ++l)
      for (int m = -l; m <= l; ++m)
        EXPECT_NEAR(harmonics.values()[static_cast<std::size_t>(l * l + l + m)],
                    harmonic(l, m, theta, phi), 1e-12)
            << l << " " << m << " at " << theta;
  }
}

// The integral is by Fejer's first rule over theta, with the sine in its weights, and equal steps
// of phi, which is exact for polynomials of the degree of a product.
TEST(SphericalHarmonics, AreOrthonormal) {
  constexpr int kSteps = 64;
  constexpr int kRound = 40;
  const std::size_t count = harmonicCount(kHighestMultipole);
  Eigen::MatrixXd gram =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(count), static_cast<Eigen::Index>(count));
  for (int row = 0; row < kSteps; ++row) {
    const double theta = kPi * (row + 0.5) / kSteps;
    double weight = 1.0;
    for (int j = 1; j <= kSteps / 2; ++j)
      weight -= 2.0 * std::cos(2.0 * j * theta) / (4.0 * j * j - 1.0);
    weight *= 2.0 / kSteps * 2.0 * kPi / kRound;
    for (int step = 0; step < kRound; ++step) {
      const DirectionHarmonics harmonics(toward(theta, 2.0 * kPi * step / kRound));
      const Eigen::Map<const Eigen::VectorXd> values(harmonics.values().data(), gram.rows());
      gram.selfadjointView<Eigen::Lower>().rankUpdate(values, weight);
    }
  }
  const Eigen::MatrixXd full = gram.selfadjointView<Eigen::Lower>();
  EXPECT_LT((full - Eigen::MatrixXd::Identity(full.rows(), full.cols())).cwiseAbs().maxCoeff(),
            1e-12);
}

TEST(MultipoleTransfer, RadialFunctionsAreHankelsLessTheDelay) {
  const double theta = 1.1, phi = 0.7, k = 5.0;
  const DirectionHarmonics direction(toward(theta, phi));
  for (int l = 0; l <= kHighestMultipole; ++l) {
    ModeRadiation radiation;
    radiation.multipoles.assign(harmonicCount(l), 0.0);
    radiation.multipoles.back() = {0.6, -0.8};  // m = l
    for (const double kr : {0.3, 1.0, 4.0, 30.0}) {
      const double r = kr / k;
      const Complex expected = Complex(0.6, -0.8) * iToThe(-l - 1) * hankel(l, kr) * kr *
                               std::polar(1.0, kr) * harmonic(l, l, theta, phi) / r;
      const Complex transfer = multipoleTransfer(radiation, direction, k, r);
      EXPECT_LT(std::abs(transfer - expected), 1e-10 * std::abs(expected)) << l << " at " << kr;
    }
  }
}

TEST(MultipoleTransfer, PointSourceOffTheCentreIsReproducedNearAndFar) {
  const double k = 12.0, offset = 0.1;
  const ModeRadiation source = pointSourceAt(offset, 0.8, 2.0, k, 16);
  for (const double r : {0.4, 1.0, 20.0}) {
    for (const Vec3& d : {toward(0.8, 2.0), toward(2.5, -1.0), toward(1.3, 0.0)}) {
      const Complex transfer = multipoleTransfer(source, DirectionHarmonics(d), k, r);
      const double away = (r * d - offset * toward(0.8, 2.0)).norm();
      const Complex expected = std::polar(1.0 / away, -k * (away - r));
      EXPECT_LT(std::abs(transfer - expected), 1e-6 * std::abs(expected)) << r;
    }
  }
}

TEST(MultipoleTransfer, LeavesOutWhatIsAboveTheOrderOfEither) {
  const ModeRadiation source = pointSourceAt(0.1, 0.8, 2.0, 12.0, 6);
  ModeRadiation cut = source;
  cut.multipoles.resize(harmonicCount(3));
  const Vec3 d = toward(0.5, 0.5);
  EXPECT_EQ(multipoleOrder(source), 6);
  EXPECT_EQ(multipoleOrder(cut), 3);
  EXPECT_EQ(multipoleOrder({}), -1);
  EXPECT_EQ(multipoleTransfer(source, DirectionHarmonics(d, 3), 12.0, 2.0),
            multipoleTransfer(cut, DirectionHarmonics(d), 12.0, 2.0));
  EXPECT_EQ(multipoleTransfer({}, DirectionHarmonics(d), 12.0, 2.0), Complex(0.0));
}

// Tests a point source of 1 / r in any direction, wherever it is, and a breathing source in air.
TEST(MeanTransfer, IsThatOfThePowerHoweverTheSourceLies) {
  EXPECT_NEAR(meanTransfer(pointSourceAt(0.1, 0.8, 2.0, 12.0, 16)), 1.0, 1e-9);
  EXPECT_NEAR(meanTransfer(pointSourceAt(0.3, 2.8, 1.0, 12.0, 16)), 1.0, 1e-6);
  const ModeRadiation breathing{.volume = 3.0, .multipoles = {}};
  EXPECT_DOUBLE_EQ(monopoleTransfer(breathing, 1.2, 5.0), 1.2 * 3.0 / (4.0 * kPi * 5.0));
}

TEST(EnclosingRadius, IsThatOfTheFarthestCornerInUse) {
  SurfaceMesh box = boxMesh({1, 2, 2});
  box.vertices.emplace_back(100, 0, 0);
  EXPECT_DOUBLE_EQ(enclosingRadius(box, Vec3::Zero()), 3.0);
  EXPECT_DOUBLE_EQ(enclosingRadius(box, Vec3(1, 2, 2)), 6.0);
}

TEST(MultipoleTransfer, DoesNotAllocate) {
  const ModeRadiation source = pointSourceAt(0.1, 0.8, 2.0, 12.0, 12);
  const test::NoAllocScope none;
  const DirectionHarmonics direction(Vec3(1, 2, 3));
  Complex sum = 0.0;
  for (int mode = 0; mode < 10; ++mode)
    sum += multipoleTransfer(source, direction, 12.0 + mode, 2.0);
  EXPECT_NE(sum, Complex(0.0));
  EXPECT_EQ(none.allocations(), 0u);
}

}  // namespace
}  // namespace carom
