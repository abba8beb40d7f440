#include "modal/radiation/mode_radiation.h"

#include <cmath>
#include <complex>
#include <cstdint>
#include <functional>
#include <numbers>
#include <string>
#include <string_view>
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
constexpr double kAir = 1.2;  // kg/m^3, the density of a Medium

RadiationReport radiate(ModalModel& model, const RadiationSettings& settings = {}) {
  const Result<RadiationReport> report = computeRadiation(model, settings);
  EXPECT_TRUE(report) << (report ? "" : report.error().message);
  return report ? *report : RadiationReport{};
}

std::string refusal(ModalModel model, const RadiationSettings& settings = {}) {
  const Result<RadiationReport> report = computeRadiation(model, settings);
  return report ? "" : report.error().message;
}

std::vector<Vec3> someDirections() {
  std::vector<Vec3> directions;
  for (int spot = 0; spot < 30; ++spot) {
    const double z = 1.0 - (2.0 * spot + 1.0) / 30.0;
    directions.emplace_back(std::sqrt(1 - z * z) * std::cos(2.4 * spot),
                            std::sqrt(1 - z * z) * std::sin(2.4 * spot), z);
  }
  return directions;
}

// Largest error in any direction, relative to the largest pressure.
template <class Expected>
double farError(const std::function<Complex(const Vec3&)>& got, const Expected& expected) {
  double worst = 0.0;
  double peak = 0.0;
  for (const Vec3& d : someDirections()) {
    worst = std::max(worst, std::abs(got(d) - Complex(expected(d))));
    peak = std::max(peak, std::abs(Complex(expected(d))));
  }
  return worst / peak;
}

double farErrorOf(const ModalModel& model, std::size_t mode,
                  const std::function<Complex(const Vec3&)>& expected) {
  return farError([&](const Vec3& d) { return farField(model.modes[mode].radiation, d); },
                  expected);
}

// Far field of the outgoing wave -rho0 h_n(kr) P_n / (k h_n'(ka)), with h_n^(2)' and i^(n + 1).
Complex farOfSphere(int n, double ka, double k) {
  const auto order = static_cast<unsigned>(n);
  const Complex here(test::sphericalBessel(order, ka), -test::sphericalNeumann(order, ka));
  const Complex above(test::sphericalBessel(order + 1, ka), -test::sphericalNeumann(order + 1, ka));
  return -kAir * std::pow(Complex(0, 1), n + 1) / (k * k * (n / ka * here - above));
}

// The mesh is finer than the panels, so that it is clustered.
TEST(ModeRadiation, SphereThatBreathesSwingsAndFlattensIsTheClosedForm) {
  const double radius = 0.05;
  for (const double ka : {0.1, kPi}) {
    ModalModel model = modelOf(ellipsoidMesh(Vec3::Constant(radius), 4));
    const double k = ka / radius;
    addMode(model, frequencyOf(model, k), [](const Vec3& at) { return Vec3(at.normalized()); });
    addMode(model, frequencyOf(model, k), [](const Vec3&) { return Vec3(Vec3::UnitZ()); });
    addMode(model, frequencyOf(model, k), [](const Vec3& at) {
      return Vec3(at.normalized() * test::legendrePolynomial(2u, at.normalized().z()));
    });
    const RadiationReport report = radiate(model);
    EXPECT_LE(report.panels, 800u);
    for (int n = 0; n <= 2; ++n) {
      const ModeRadiation& radiation = model.modes[static_cast<std::size_t>(n)].radiation;
      EXPECT_LT(farErrorOf(model, static_cast<std::size_t>(n),
                           [&](const Vec3& d) {
                             return farOfSphere(n, ka, k) *
                                    test::legendrePolynomial(static_cast<unsigned>(n), d.z());
                           }),
                0.01 * (n + 1))
          << n << " at " << ka;
      EXPECT_EQ(multipoleOrder(radiation), n) << "no more than it takes";
    }
    EXPECT_NEAR(model.modes[0].radiation.volume, 4.0 * kPi * radius * radius,
                0.005 * 4.0 * kPi * radius * radius);
  }
}

// The resistance of a sphere's surface for a velocity P_n is rho0 c / ((k a)^2 |h_n'(k a)|^2), by
// the Wronskian (Morse and Ingard, Theoretical Acoustics, section 7.2). It takes half of its square
// velocity as power, twice its rate of the mode's energy.
TEST(ModeRadiation, SphereLosesWhatTheResistanceOfTheAirTakes) {
  const double radius = 0.05;
  const double material = 0.5;  // 1/s
  for (const double ka : {0.3, 1.0, kPi}) {
    ModalModel model = modelOf(ellipsoidMesh(Vec3::Constant(radius), 4));
    const double k = ka / radius;
    addMode(model, frequencyOf(model, k), [](const Vec3& at) { return Vec3(at.normalized()); });
    addMode(model, frequencyOf(model, k), [](const Vec3&) { return Vec3(Vec3::UnitZ()); });
    addMode(model, frequencyOf(model, k), [](const Vec3& at) {
      return Vec3(at.normalized() * test::legendrePolynomial(2u, at.normalized().z()));
    });
    for (Mode& mode : model.modes)
      mode.decayRate = material;
    radiate(model);
    addRadiationDamping(model);
    for (int n = 0; n <= 2; ++n) {
      const auto order = static_cast<unsigned>(n);
      const Complex here(test::sphericalBessel(order, ka), -test::sphericalNeumann(order, ka));
      const Complex above(test::sphericalBessel(order + 1, ka),
                          -test::sphericalNeumann(order + 1, ka));
      const double slope = std::abs(n / ka * here - above);
      const double square = 4.0 * kPi * radius * radius / (2.0 * n + 1.0);
      const double lost = 0.5 * kAir * 343.0 * square / (ka * ka * slope * slope);
      const Mode& mode = model.modes[static_cast<std::size_t>(n)];
      EXPECT_NEAR(mode.radiation.decayRate, lost, 0.02 * (n + 1) * lost) << n << " at " << ka;
      EXPECT_DOUBLE_EQ(mode.decayRate, material + mode.radiation.decayRate);
    }
    radiate(model);
    EXPECT_NEAR(model.modes[0].decayRate, material, 1e-9) << "computed anew, it has none of it yet";
  }
}

// Modes that would lose more than perturbation allows keep half of critical damping.
TEST(ModeRadiation, DampingByRadiationStaysBelowCritical) {
  ModalModel model = modelOf(ellipsoidMesh(Vec3::Constant(0.05), 2));
  addMode(model, 500.0, [](const Vec3& at) { return Vec3(100.0 * at.normalized()); });
  radiate(model);
  addRadiationDamping(model);
  EXPECT_GT(radiatedDecay(model.modes[0], model.medium), 2.0 * kPi * 500.0);
  EXPECT_NEAR(model.modes[0].decayRate, kPi * 500.0, 1e-9);
  EXPECT_TRUE(validate(model));
}

// Real and imaginary part of the source's velocity are two modes; far away they sum to exp(i k
// d.y), with y from the centre of mass, which is neither the origin nor the middle.
TEST(ModeRadiation, PointSourceInABoxIsHeardWhereItIs) {
  const double k = 10.0;
  const Vec3 middle(1.0, -2.0, 3.0);
  const Vec3 source = middle + Vec3(0.02, 0.01, -0.01);
  const SurfaceMesh box = splitMesh(splitMesh(splitMesh(boxMesh({0.1, 0.07, 0.05}))));
  ModalModel model = modelOf(mapped(box, [&](const Vec3& at) { return Vec3(at + middle); }));
  model.centreOfMass = middle + Vec3(-0.03, 0.0, 0.02);
  const auto motion = [&](const Vec3& at) {
    const double r = (at - source).norm();
    const Complex slope = std::polar(1.0 / r, -k * r) * Complex(-1.0 / r, -k) / -kAir;
    return std::pair<Vec3, Vec3>(slope.real() * (at - source) / r,
                                 slope.imag() * (at - source) / r);
  };
  addMode(model, frequencyOf(model, k), [&](const Vec3& at) { return motion(at).first; });
  addMode(model, frequencyOf(model, k), [&](const Vec3& at) { return motion(at).second; });
  radiate(model);
  const double error = farError(
      [&](const Vec3& d) {
        return farField(model.modes[0].radiation, d) +
               Complex(0, 1) * farField(model.modes[1].radiation, d);
      },
      [&](const Vec3& d) { return std::polar(1.0, k * d.dot(source - model.centreOfMass)); });
  EXPECT_LT(error, 0.02);
}

// Each slice of a slender round bar radiates as a dipole of the air that it displaces plus as much
// added mass: rho0 pi a^2 w'' twice (Junger and Feit, Sound, Structures, and Their Interaction).
// The far field is the retarded sum over the slices.
TEST(ModeRadiation, SlenderBarThatBendsIsALineOfDipoles) {
  const double radius = 0.004;
  const double halfLength = 0.25;
  const double k = 8.0;
  const auto bend = [&](double x) {
    return std::pow(std::cos(0.5 * kPi * x / halfLength), 2.0) * std::cos(2.0 * kPi * x / 0.25);
  };
  // The section's area is that of the circle.
  const double corner = radius * std::sqrt(kPi / (6.0 * std::sin(kPi / 6.0)));
  ModalModel model = modelOf(barMesh({halfLength, corner, corner}, 25, 12));
  addMode(model, frequencyOf(model, k), [&](const Vec3& at) { return Vec3(0, bend(at.x()), 0); });
  radiate(model);
  const auto expected = [&](const Vec3& d) {
    Complex sum = 0.0;
    const int slices = 1000;
    for (int slice = 0; slice < slices; ++slice) {
      const double x = halfLength * ((2.0 * slice + 1.0) / slices - 1.0);
      sum += bend(x) * std::polar(2.0 * halfLength / slices, k * x * d.x());
    }
    return Complex(0, 1) * k * 2.0 * kAir * kPi * radius * radius * d.y() / (4.0 * kPi) * sum;
  };
  const double error = farErrorOf(model, 0, expected);
  EXPECT_LT(error, 0.03);
  EXPECT_NEAR(model.modes[0].radiation.volume, 0.0, 1e-9);
}

TEST(ModeRadiation, VolumeIsTheIntegralOfTheNormalComponent) {
  ModalModel model = modelOf(boxMesh({0.1, 0.2, 0.3}));
  addMode(model, 20.0, [](const Vec3& at) { return Vec3(0, at.y() + 5.0, 0); });
  addMode(model, 20.0, [](const Vec3&) { return Vec3(1, 2, 3); });
  radiate(model, {.panels = 100});
  EXPECT_NEAR(model.modes[0].radiation.volume, 0.048, 1e-7);
  EXPECT_NEAR(model.modes[1].radiation.volume, 0.0, 1e-7);
  // At long waves only the volume counts.
  EXPECT_NEAR(std::abs(farField(model.modes[0].radiation, Vec3::UnitX())),
              kAir * 0.048 / (4.0 * kPi), 0.02 * kAir * 0.048 / (4.0 * kPi));
}

// A round disc with vertices in rings, facing z.
SurfaceMesh discMesh(double radius, int rings) {
  SurfaceMesh mesh;
  mesh.vertices.emplace_back(0.0, 0.0, 0.0);
  const int around = 24;
  const auto at = [&](int ring, int corner) {
    return static_cast<std::uint32_t>(1 + (ring - 1) * around + corner % around);
  };
  const double grow = std::sqrt(2.0 * kPi / around / std::sin(2.0 * kPi / around));
  for (int ring = 1; ring <= rings; ++ring) {
    const double out = grow * radius * std::sin(0.5 * kPi * ring / rings);
    for (int corner = 0; corner < around; ++corner) {
      const double turn = 2.0 * kPi * corner / around;
      mesh.vertices.emplace_back(out * std::cos(turn), out * std::sin(turn), 0.0);
      if (ring == 1) {
        mesh.triangles.push_back({0, at(1, corner), at(1, corner + 1)});
        continue;
      }
      mesh.triangles.push_back({at(ring - 1, corner), at(ring, corner), at(ring, corner + 1)});
      mesh.triangles.push_back(
          {at(ring - 1, corner), at(ring, corner + 1), at(ring - 1, corner + 1)});
    }
  }
  return mesh;
}

// A thin disc that moves along its axis has the added mass 8/3 rho0 a^3 (Lamb, Hydrodynamics,
// article 102), and its dipole is that mass times the acceleration.
TEST(ModeRadiation, OpenDiscIsASheetOfTheModelsMassAndHasLambsDipole) {
  const double radius = 0.1;
  const double k = 0.5;
  ModalModel model = modelOf(discMesh(radius, 8));
  const double thickness = 0.001;
  model.mass = model.material.density * thickness * kPi * radius * radius;
  addMode(model, frequencyOf(model, k), [](const Vec3&) { return Vec3(Vec3::UnitZ()); });
  const RadiationReport report = radiate(model);
  EXPECT_NEAR(report.thickness, thickness, 1e-6);
  const double moved = 8.0 / 3.0 * std::pow(radius, 3.0) + kPi * radius * radius * thickness;
  EXPECT_LT(farErrorOf(model, 0,
                       [&](const Vec3& d) {
                         return Complex(0, 1) * k * kAir * moved * d.z() / (4.0 * kPi);
                       }),
            0.03);
}

// Plates of 0.1 and 0.01 mm carry the same wave and sound alike.
TEST(ModeRadiation, ThinPlatesSoundAlikeHoweverThin) {
  std::vector<ModalModel> plates;
  for (const double half : {0.00005, 0.000005}) {
    ModalModel& model =
        plates.emplace_back(modelOf(splitMesh(splitMesh(boxMesh({0.1, 0.1, half})))));
    addMode(model, frequencyOf(model, 30.0),
            [](const Vec3& at) { return Vec3(0, 0, std::cos(30.0 * at.x()) * at.y()); });
    radiate(model);
  }
  EXPECT_LT(farErrorOf(plates[1], 0,
                       [&](const Vec3& d) { return farField(plates[0].modes[0].radiation, d); }),
            0.01);
}

TEST(ModeRadiation, OrdersThatAreCutLeaveTheirPower) {
  ModalModel model = modelOf(barMesh({0.2, 0.02, 0.02}, 40, 4));
  addMode(model, frequencyOf(model, 60.0),
          [](const Vec3& at) { return Vec3(0, std::cos(70.0 * at.x()), 0); });
  EXPECT_EQ(radiate(model, {.maxOrder = 16}).cutModes, 0u);
  const ModeRadiation whole = model.modes[0].radiation;
  EXPECT_GT(multipoleOrder(whole), 8);
  EXPECT_EQ(radiate(model, {.maxOrder = 4}).cutModes, 1u);
  EXPECT_EQ(multipoleOrder(model.modes[0].radiation), 4);
  EXPECT_NEAR(meanTransfer(model.modes[0].radiation) / meanTransfer(whole), 1.0, 0.01);
}

TEST(ModeRadiation, SaysWhichModesAreRough) {
  ModalModel model = modelOf(boxMesh({0.1, 0.1, 0.1}));
  addMode(model, 100.0, [](const Vec3& at) { return at; });
  addMode(model, 15000.0, [](const Vec3& at) { return at; });
  const RadiationReport coarse = radiate(model, {.panels = 100});
  EXPECT_EQ(coarse.roughModes, 1u);
  EXPECT_FALSE(model.modes[1].radiation.multipoles.empty());
  EXPECT_TRUE(validate(model));
  // The panels have a quarter of the area, so that they are half as large.
  const RadiationReport fine = radiate(model, {.panels = 400});
  EXPECT_EQ(fine.panels, 4 * coarse.panels);
  EXPECT_NEAR(fine.goodUpTo, 2.0 * coarse.goodUpTo, 1e-9 * fine.goodUpTo);
}

TEST(ModeRadiation, IsTheSameBitsOnAnyNumberOfThreads) {
  ModalModel one = modelOf(boxMesh({0.1, 0.08, 0.05}));
  for (const double frequency : {200.0, 900.0, 3000.0, 9000.0, 15000.0})
    addMode(one, frequency,
            [&](const Vec3& at) { return Vec3(std::cos(frequency * at.x()), 0, 1); });
  ModalModel three = one;
  const RadiationReport alone = radiate(one, {.panels = 200, .threads = 1});
  const RadiationReport together = radiate(three, {.panels = 200, .threads = 3});
  EXPECT_EQ(alone.roughModes, together.roughModes);
  EXPECT_EQ(alone.cutModes, together.cutModes);
  for (std::size_t mode = 0; mode < one.modes.size(); ++mode) {
    EXPECT_EQ(one.modes[mode].radiation.volume, three.modes[mode].radiation.volume);
    EXPECT_EQ(one.modes[mode].radiation.multipoles, three.modes[mode].radiation.multipoles);
  }
}

TEST(ModeRadiation, RefusesWithAReasonAndCancelsLeavingTheModelAsItWas) {
  ModalModel model = modelOf(boxMesh({0.1, 0.1, 0.1}));
  addMode(model, 100.0, [](const Vec3& at) { return at; });
  addMode(model, 200.0, [](const Vec3& at) { return at; });
  EXPECT_NE(refusal(model, {.panels = 10}).find("at least 100"), std::string::npos);
  EXPECT_NE(refusal(model, {.maxOrder = 17}).find("0 to 16"), std::string::npos);
  ModalModel without = model;
  without.mass = 0.0;
  EXPECT_NE(refusal(without).find("mass"), std::string::npos);
  ModalModel twisted = model;
  std::swap(twisted.surface.triangles[0][1], twisted.surface.triangles[0][2]);
  EXPECT_NE(refusal(twisted).find("opposite ways"), std::string::npos) << refusal(twisted);

  std::vector<double> told;
  const Result<RadiationReport> report = computeRadiation(model, {.panels = 100, .threads = 1},
                                                          [&](std::string_view, double fraction) {
                                                            told.push_back(fraction);
                                                            return fraction < 0.5;
                                                          });
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().message, kCancelled);
  EXPECT_EQ(told, (std::vector<double>{0.0, 0.5}));
  EXPECT_TRUE(model.modes[0].radiation.multipoles.empty());
}

}  // namespace
}  // namespace carom::test
