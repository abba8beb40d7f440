// Tests the references of the tests of solid analysis against published figures.

#include "tests/support/vibration_references.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/constants.h"

namespace carom::test {
namespace {

Material metal(double poissonsRatio) {
  Material material;
  material.density = 2700.0;
  material.youngsModulus = 70e9;
  material.poissonsRatio = poissonsRatio;
  return material;
}

// Speed of shear waves in m/s.
double shearSpeed(const Material& material) {
  return std::sqrt(material.youngsModulus / (2.0 * (1.0 + material.poissonsRatio)) /
                   material.density);
}

// The values of (k L)^2 are from Blevins, Formulas for natural frequency and mode shape (1979),
// table 8-1.
TEST(VibrationReferences, ASlenderBeamBendsAsEulerHasIt) {
  const Material material = metal(0.33);
  const std::vector<double> found = bendingFrequencies(material, 1.0, 1e-3, 1e-3, 5);
  const double unit =
      std::sqrt(material.youngsModulus / material.density / 12.0) * 1e-3 / (2.0 * kPi);
  const std::array<double, 5> roots = {4.73004074, 7.85320462, 10.9956078, 14.1371655, 17.2787597};
  for (std::size_t mode = 0; mode < roots.size(); ++mode)
    EXPECT_NEAR(found[mode], roots[mode] * roots[mode] * unit, 1e-4 * found[mode]);
}

// The oracle takes the roots of Timoshenko's characteristic equation in closed form, and the ends'
// conditions as a determinant (Huang, J. Appl. Mech. 28 (1961) 579), which changes sign at each
// frequency.
TEST(VibrationReferences, AThickBeamSolvesTheFrequencyEquation) {
  const Material material = metal(0.3);
  const double length = 0.2;
  const double depth = 0.03;
  const double r2 = depth * depth / 12.0 / (length * length);
  const double shear = shearCoefficient(depth, depth, 0.3);
  const double s2 = r2 * 2.6 / shear;
  const double unit = std::sqrt(material.youngsModulus / material.density * r2) / length;
  const auto equation = [&](double frequency) {
    const double b = 2.0 * kPi * frequency / unit;
    const double root = std::sqrt((r2 - s2) * (r2 - s2) + 4.0 / (b * b));
    const double alpha = std::sqrt(0.5 * (root - (r2 + s2)));
    const double beta = std::sqrt(0.5 * (root + (r2 + s2)));
    const double mixed =
        b / std::sqrt(1.0 - b * b * r2 * s2) * (b * b * r2 * (r2 - s2) * (r2 - s2) + 3.0 * r2 - s2);
    return 2.0 - 2.0 * std::cosh(b * alpha) * std::cos(b * beta) +
           mixed * std::sinh(b * alpha) * std::sin(b * beta);
  };
  for (const double frequency : bendingFrequencies(material, length, depth, depth, 4))
    EXPECT_LT(equation(0.9999 * frequency) * equation(1.0001 * frequency), 0.0) << frequency;
}

// The first value is Hutchinson's limit for narrow sections.
TEST(VibrationReferences, TheShearCoefficientOfANarrowBeam) {
  EXPECT_NEAR(shearCoefficient(1.0, 1e-3, 0.3), 5.0 * 1.3 / 7.5, 1e-6);
  EXPECT_NEAR(shearCoefficient(1.0, 2.0, 0.0), 5.0 / 6.0, 1e-6);
}

// The constants are from Timoshenko and Goodier, Theory of Elasticity (1951), table in section 109.
TEST(VibrationReferences, RectanglesTwistAsTabulated) {
  EXPECT_NEAR(rectangleTorsion(1.0, 1.0).constant, 0.1406, 1e-4);
  EXPECT_NEAR(rectangleTorsion(2.0, 1.0).constant, 0.229 * 2.0, 1e-3);
  EXPECT_NEAR(rectangleTorsion(3.0, 1.0).constant, 0.263 * 3.0, 1e-3);
  // The warping of a thin rectangle is the product of both coordinates.
  EXPECT_NEAR(rectangleTorsion(1.0, 0.01).warping, 1e-6 / 144.0, 0.03 * 1e-6 / 144.0);
}

// Without warping stress the bar twists in half waves of c_T sqrt(constant / polar moment).
TEST(VibrationReferences, ALongBarTwistsInHalfWaves) {
  const Material material = metal(0.3);
  const std::vector<double> found = twistingFrequencies(material, 10.0, 0.03, 0.01, 3);
  const double polar = 3e-4 * 1e-3 / 12.0;
  const double speed = shearSpeed(material) * std::sqrt(0.2633 * 0.03e-6 / polar);
  for (std::size_t mode = 0; mode < 3; ++mode)
    EXPECT_NEAR(found[mode], static_cast<double>(mode + 1) * speed / 20.0, 1e-3 * found[mode]);
}

// The values of omega side^2 sqrt(rho h / D) at nu = 0.3 are from Leissa, J. Sound Vib. 31 (1973)
// 257, table C21, with 36 terms, and so up to 1 % too high; the frequencies in Hz are from NAFEMS
// benchmark FV12 (side 10, h 0.05, E 200e9, rho 8000), as FinEtools' example FV12_vibration quotes
// it.
TEST(VibrationReferences, APlateRingsAsTabulated) {
  Material steel = metal(0.3);
  steel.youngsModulus = 200e9;
  steel.density = 8000.0;
  const std::vector<double> found = squarePlateFrequencies(steel, 10.0, 0.05, 8);
  const std::array<double, 8> benchmark = {1.622, 2.360, 2.922, 4.190, 4.190, 7.356, 7.356, 7.668};
  for (std::size_t mode = 0; mode < 8; ++mode)
    EXPECT_NEAR(found[mode], benchmark[mode], 0.001) << mode;
  const double unit = std::sqrt(200e9 * 0.0025 / (10.92 * 8000.0)) / (200.0 * kPi);
  const std::array<double, 6> leissa = {13.489, 19.789, 24.432, 35.024, 35.024, 61.526};
  for (std::size_t mode = 0; mode < 6; ++mode) {
    EXPECT_LT(found[mode], leissa[mode] * unit) << mode;
    EXPECT_GT(found[mode], 0.99 * leissa[mode] * unit) << mode;
  }
}

// The figures are Lamb's own: omega radius / c_T over pi.
TEST(VibrationReferences, ASphereRingsAsLambTabulatedIt) {
  const Material material = metal(0.25);
  const double unit = shearSpeed(material) / 2.0;
  const std::vector<double> found = sphereFrequencies(material, 1.0, 20);
  for (std::size_t mode = 0; mode < 5; ++mode) {
    EXPECT_NEAR(found[mode] / unit, 0.7961, 1e-4);
    EXPECT_NEAR(found[mode + 5] / unit, 0.840, 1e-3);
  }
  // The twisting modes n = 1 and 3 have tan k = 3 k / (3 - k^2), and 1.2303.
  EXPECT_NEAR(found[13] / unit, 1.2303, 1e-3);
  const double k = 5.7634591968945498;
  EXPECT_NEAR(std::tan(k), 3.0 * k / (3.0 - k * k), 1e-9);
  const std::vector<double> more = sphereFrequencies(material, 1.0, 100);
  EXPECT_EQ(std::count_if(more.begin(), more.end(),
                          [&](double f) { return std::abs(f * kPi / unit - k) < 1e-6; }),
            3);
}

// ---- The box

// Lame's modes are exact: u = (sin kx cos ky, -cos kx sin ky, 0), k = pi / edge, and the same in
// the two other planes.
TEST(VibrationReferences, ACubeHasLamesModes) {
  const Material material = metal(0.3);
  const double expected = shearSpeed(material) / (std::numbers::sqrt2 * 0.1);
  int found = 0;
  for (const BoxMode& mode : boxModes(material, {0.1, 0.1, 0.1}, {9, 9, 9}, 30))
    if (std::abs(mode.frequency - expected) < 1e-6 * expected) ++found;
  EXPECT_EQ(found, 3);
}

TEST(VibrationReferences, ASlenderBoxIsABeam) {
  const Material material = metal(0.33);
  const std::array<std::vector<double>, 4> theory = {
      stretchingFrequencies(material, 0.4, 0.03, 0.01, 1),
      bendingFrequencies(material, 0.4, 0.03, 0.01, 3),
      bendingFrequencies(material, 0.4, 0.01, 0.03, 6),
      twistingFrequencies(material, 0.4, 0.03, 0.01, 3)};
  std::array<std::size_t, 4> next{};
  for (const BoxMode& mode : boxModes(material, {0.4, 0.03, 0.01}, {22, 6, 4}, 11)) {
    const std::size_t kind = (mode.odd[1] ? 1U : 0U) + (mode.odd[2] ? 2U : 0U);
    ASSERT_LT(next[kind], theory[kind].size());
    const double expected = theory[kind][next[kind]++];
    EXPECT_NEAR(mode.frequency, expected, 0.002 * expected) << kind;
  }
}

TEST(VibrationReferences, AThinBoxIsAPlate) {
  const Material material = metal(0.3);
  const std::vector<double> theory = squarePlateFrequencies(material, 0.3, 0.001, 10);
  const std::vector<BoxMode> found = boxModes(material, {0.3, 0.3, 0.001}, {12, 12, 3}, 10);
  for (std::size_t mode = 0; mode < found.size(); ++mode)
    EXPECT_NEAR(found[mode].frequency, theory[mode], 0.001 * theory[mode]) << mode;
}

}  // namespace
}  // namespace carom::test
