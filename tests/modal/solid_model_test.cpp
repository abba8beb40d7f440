#include "modal/analysis/solid_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "modal/analysis/audible_modes.h"
#include "tests/audio/meshes.h"
#include "tests/support/constants.h"
#include "tests/support/revolution_modes.h"

namespace carom {

using namespace modal;

namespace {

using namespace test;

using Eigen::Index;
using Eigen::VectorXd;
using testing::HasSubstr;

const Eigen::Matrix3d kSomeTurn =
    Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();

Material metal(double poissonsRatio) {
  Material material;
  material.name = "metal";
  material.density = 2700.0;
  material.youngsModulus = 70e9;
  material.poissonsRatio = poissonsRatio;
  return material;
}

SurfaceMesh turned(const SurfaceMesh& surface) {
  return mapped(surface, [](const Vec3& vertex) { return Vec3(kSomeTurn * vertex); });
}

// A round rod along x, with 64 sides.
SurfaceMesh rod(double radius, double length) {
  constexpr std::uint32_t kSides = 64;
  SurfaceMesh mesh;
  for (const double x : {-0.5 * length, 0.5 * length}) {
    for (std::uint32_t side = 0; side < kSides; ++side) {
      const double angle = 2.0 * kPi * side / kSides;
      mesh.vertices.emplace_back(x, radius * std::cos(angle), radius * std::sin(angle));
    }
  }
  mesh.vertices.emplace_back(-0.5 * length, 0.0, 0.0);
  mesh.vertices.emplace_back(0.5 * length, 0.0, 0.0);
  for (std::uint32_t side = 0; side < kSides; ++side) {
    const std::uint32_t next = (side + 1) % kSides;
    mesh.triangles.push_back({side, side + kSides, next});
    mesh.triangles.push_back({next, side + kSides, next + kSides});
    mesh.triangles.push_back({2 * kSides, side, next});
    mesh.triangles.push_back({2 * kSides + 1, next + kSides, side + kSides});
  }
  return signedVolume(mesh) > 0.0 ? mesh : turnedInsideOut(mesh);
}

SolidSettings coarse(std::size_t degreesOfFreedom, Index maxModes) {
  SolidSettings settings;
  settings.grid.degreesOfFreedom = degreesOfFreedom;
  settings.maxModes = maxModes;
  return settings;
}

SolidSystem systemOf(const SurfaceMesh& surface, const Material& material,
                     std::size_t degreesOfFreedom) {
  Result<SolidSystem> system = solidSystem(surface, material, coarse(degreesOfFreedom, 1).grid);
  EXPECT_TRUE(system) << (system ? "" : system.error().message);
  return system ? *std::move(system) : SolidSystem{};
}

SolidAnalysis analysed(const SurfaceMesh& surface, const Material& material,
                       const SolidSettings& settings) {
  Result<SolidAnalysis> analysis = analyseSolid(surface, material, settings);
  EXPECT_TRUE(analysis) << (analysis ? "" : analysis.error().message);
  return analysis ? *std::move(analysis) : SolidAnalysis{};
}

// Frequencies of all modes, audible or not.
VectorXd frequencies(const SurfaceMesh& surface, const Material& material,
                     std::size_t degreesOfFreedom, Index count) {
  const SolidSystem system = systemOf(surface, material, degreesOfFreedom);
  EigenSettings settings;
  settings.modes = 6 + count;
  const Result<EigenSolution> solution = lowestModes(system.stiffness, system.mass, settings);
  EXPECT_TRUE(solution && solution->counted);
  if (!solution) return VectorXd::Zero(count);
  const double lowest = solution->lambda[6];
  EXPECT_LT(solution->lambda.head<6>().cwiseAbs().maxCoeff(), 1e-8 * lowest);
  return solution->lambda.tail(count).cwiseSqrt() / (2.0 * kPi);
}

// The field u = gradient x + shift at the nodes.
VectorXd linearField(const SolidSystem& system, const Eigen::Matrix3d& gradient,
                     const Vec3& shift) {
  VectorXd field(system.stiffness.rows());
  for (std::size_t node = 0; node < system.grid.nodes.size(); ++node)
    field.segment<3>(static_cast<Index>(3 * node)) = gradient * system.grid.nodes[node] + shift;
  return field;
}

Eigen::Matrix3d crossMatrix(const Vec3& axis) {
  Eigen::Matrix3d matrix;
  matrix << 0, -axis.z(), axis.y(), axis.z(), 0, -axis.x(), -axis.y(), axis.x(), 0;
  return matrix;
}

std::vector<SurfaceMesh> variousBodies() {
  return {boxMesh({0.05, 0.03, 0.02}), turned(boxMesh({0.05, 0.03, 0.02})),
          turned(ellipsoidMesh({0.05, 0.03, 0.04}, 3))};
}

// ---- Matrices

TEST(SolidModel, RigidMotionsMeetNoForce) {
  for (const SurfaceMesh& surface : variousBodies()) {
    const SolidSystem system = systemOf(surface, metal(0.33), 2000);
    const double stiffest = system.stiffness.diagonal().maxCoeff();
    const Vec3 shift(1.0, -2.0, 0.5);
    const VectorXd moved = linearField(system, Eigen::Matrix3d::Zero(), shift);
    EXPECT_LT((system.stiffness * moved).lpNorm<Eigen::Infinity>(), 1e-12 * stiffest);
    const VectorXd spun = linearField(system, crossMatrix({3.0, 1.0, -2.0}), Vec3::Zero());
    EXPECT_LT((system.stiffness * spun).lpNorm<Eigen::Infinity>(), 1e-12 * stiffest);
  }
}

TEST(SolidModel, MatricesAreSymmetric) {
  const SolidSystem system = systemOf(variousBodies()[2], metal(0.33), 2000);
  for (const SparseMatrix* matrix : {&system.stiffness, &system.mass}) {
    const SparseMatrix transposed = matrix->transpose();
    EXPECT_LT((*matrix - transposed).norm(), 1e-14 * matrix->norm());
  }
}

// Share of the mass that the filling outside of cut cells may add.
constexpr double kFilled = 1e-7;

bool isCut(const SolidSystem& system) {
  return !system.grid.moments.empty();
}

// The patch test: the energy is that of the body's volume, with cut cells, too; stresses balance
// where only whole cells meet.
TEST(SolidModel, ConstantStrainIsExact) {
  const Material material = metal(0.33);
  const double mu = material.youngsModulus / 2.66;  // E / (2 (1 + nu))
  const double bulk = material.youngsModulus / (3.0 * (1.0 - 2.0 * 0.33));
  Eigen::Matrix3d gradient;
  gradient << 1.0, 0.4, -0.2, 0.3, -0.5, 0.7, 0.1, 0.2, 0.6;
  const Eigen::Matrix3d strain = 0.5 * (gradient + gradient.transpose());
  const Eigen::Matrix3d shear = strain - strain.trace() / 3.0 * Eigen::Matrix3d::Identity();
  const double density = 0.5 * bulk * std::pow(strain.trace(), 2) + mu * shear.squaredNorm();
  for (const SurfaceMesh& surface : variousBodies()) {
    const SolidSystem system = systemOf(surface, material, 12000);
    const VectorXd field = linearField(system, gradient, Vec3::Zero());
    const VectorXd force = system.stiffness * field;
    const double expected = density * signedVolume(surface);
    EXPECT_NEAR(0.5 * field.dot(force), expected, (isCut(system) ? kFilled : 1e-11) * expected);
    std::vector<int> wholeAround(system.grid.nodes.size(), 0);
    for (const SplineCell& cell : system.grid.cells)
      for (const std::uint32_t node : cell.nodes)
        wholeAround[node] += cell.moments < 0 ? 1 : 0;
    int inner = 0;
    for (std::size_t node = 0; node < wholeAround.size(); ++node) {
      if (wholeAround[node] < kCellFunctions) continue;
      ++inner;
      EXPECT_LT(force.segment<3>(static_cast<Index>(3 * node)).norm(), 1e-11 * force.norm());
    }
    EXPECT_GT(inner, 50);
  }
}

TEST(SolidModel, MassIsThatOfTheSurface) {
  for (const SurfaceMesh& surface : variousBodies()) {
    const SolidSystem system = systemOf(surface, metal(0.33), 2000);
    const Vec3 speed(1.0, 2.0, 2.0);
    const VectorXd moving = linearField(system, Eigen::Matrix3d::Zero(), speed);
    const double mass = 2700.0 * signedVolume(surface);
    EXPECT_NEAR(moving.dot(system.mass * moving), 9.0 * mass,
                (isCut(system) ? 9.0 * kFilled : 1e-11) * mass);
  }
}

TEST(SolidModel, ABoxTurnsWithItsInertia) {
  const SolidSystem system = systemOf(boxMesh({0.05, 0.03, 0.02}), metal(0.33), 2000);
  const double mass = 2700.0 * 0.1 * 0.06 * 0.04;
  const VectorXd spun = linearField(system, crossMatrix(Vec3::UnitZ()), Vec3::Zero());
  const double inertia = mass / 12.0 * (0.1 * 0.1 + 0.06 * 0.06);
  EXPECT_NEAR(spun.dot(system.mass * spun), inertia, 1e-12 * inertia);
}

// ---- Frequencies

// The beam is slender enough for Euler and Bernoulli's flatwise bending; (kL)^2 of the free beam is
// from Blevins, Formulas for natural frequency and mode shape (1979), table 8-1.
TEST(SolidModel, ABeamBendsTwistsAndStretchesAsTheoryHasIt) {
  const double length = 0.4;
  const double width = 0.03;
  const double thickness = 0.01;
  const Material material = metal(0.33);
  const VectorXd found =
      frequencies(boxMesh({0.5 * length, 0.5 * width, 0.5 * thickness}), material, 2500, 12);
  const double waveSpeed = std::sqrt(material.youngsModulus / material.density);
  const double unit = waveSpeed * thickness / (std::sqrt(12.0) * 2.0 * kPi * length * length);
  EXPECT_NEAR(found[0], 22.373 * unit, 0.005 * found[0]);
  EXPECT_NEAR(found[1], 61.673 * unit, 0.007 * found[1]);
  // Saint-Venant's torsion constant of a 3 : 1 rectangle is 0.263 b t^3 (Timoshenko and Goodier,
  // Theory of Elasticity, table in section 109); the ends are free to warp.
  const double torsion = 0.263 * width * std::pow(thickness, 3);
  const double polar = width * thickness * (width * width + thickness * thickness) / 12.0;
  const double twist = waveSpeed * std::sqrt(torsion / polar / 2.66) / (2.0 * length);
  EXPECT_NEAR(found[4], twist, 0.015 * twist);
  const double stretch = waveSpeed / (2.0 * length);
  EXPECT_NEAR(found[11], stretch, 0.002 * stretch);
}

// The values of omega a^2 sqrt(rho h / D) at nu = 0.3 are from Leissa, J. Sound Vib. 31 (1973) 257,
// table C21.
TEST(SolidModel, ASquarePlateRingsAsLeissaHasIt) {
  const double side = 0.3;
  const double thickness = 0.002;
  const Material material = metal(0.3);
  const VectorXd found =
      frequencies(boxMesh({0.5 * side, 0.5 * side, 0.5 * thickness}), material, 3000, 6);
  const double stiffness = material.youngsModulus * std::pow(thickness, 3) / (12.0 * 0.91);
  const double unit = std::sqrt(stiffness / (material.density * thickness)) / (side * side);
  const std::array<double, 6> leissa = {13.489, 19.789, 24.432, 35.024, 35.024, 61.526};
  for (Index mode = 0; mode < 6; ++mode) {
    const double expected = leissa[static_cast<std::size_t>(mode)] * unit / (2.0 * kPi);
    EXPECT_NEAR(found[mode], expected, 0.01 * expected) << mode;
  }
}

// The values of omega R / c_T are from Lamb, Proc. London Math. Soc. 13 (1882) 189: 0.7961 pi for
// the sphere's twisting modes n = 2, and 0.840 pi for the oblate-prolate modes at nu = 1/4; there
// are five of each.
TEST(SolidModel, ASphereRingsAsLambHasIt) {
  const double radius = 0.05;
  const Material material = metal(0.25);
  const VectorXd found =
      frequencies(ellipsoidMesh({radius, radius, radius}, 4), material, 3000, 10);
  const double shearSpeed = std::sqrt(material.youngsModulus / 2.5 / material.density);
  for (Index mode = 0; mode < 10; ++mode) {
    const double expected = (mode < 5 ? 0.7961 : 0.840) * shearSpeed / (2.0 * radius);
    EXPECT_NEAR(found[mode], expected, 0.01 * expected) << mode;
  }
}

// A bowl with a wall of 3.2 mm, thinner than a cell, that stands at an angle to the grid: its
// section's own elements (tests/support/revolution_modes.h) have its frequencies.
TEST(SolidModel, AThinBowlRingsAsItsSectionSaysHoweverItStands) {
  const test::RevolvedBody bowl = test::revolvedBodies().front();
  const Material& ceramic = *findMaterial("ceramic");
  const std::vector<double> expected = test::revolutionFrequencies(bowl, ceramic, 6);
  SolidSettings settings;
  settings.maxModes = 6;
  const SolidAnalysis found = analysed(turned(test::revolvedMesh(bowl, 120)), ceramic, settings);
  EXPECT_TRUE(found.reachedAccuracy);
  ASSERT_EQ(found.model.modes.size(), 6u);
  constexpr double kFacets = 7e-4;  // of the circles' 120 sides: their walls are thinner
  for (std::size_t mode = 0; mode < 6; ++mode) {
    const double frequency = found.model.modes[mode].frequency;
    EXPECT_NEAR(frequency, expected[mode],
                (found.model.modes[mode].frequencyError + kFacets) * expected[mode]);
    if (mode % 2 == 1) {
      EXPECT_NEAR(frequency, found.model.modes[mode - 1].frequency, 1e-3 * frequency);
    }
  }
}

// All cells across the rod are cut. A round section does not warp, so that it twists at c_T / 2 L.
TEST(SolidModel, ARoundRodTwistsAndBendsThoughTheGridIsSquare) {
  const double length = 0.2;
  const double radius = 0.005;
  const Material material = metal(0.33);
  const VectorXd found = frequencies(rod(radius, length), material, 3000, 7);
  const double waveSpeed = std::sqrt(material.youngsModulus / material.density);
  const double bending = 22.373 * waveSpeed * 0.5 * radius / (2.0 * kPi * length * length);
  EXPECT_NEAR(found[0], bending, 0.01 * bending);
  EXPECT_NEAR(found[1], bending, 0.01 * bending);
  const double twist = waveSpeed / std::sqrt(2.66) / (2.0 * length);
  EXPECT_NEAR(found[6], twist, 0.005 * twist);
}

// Resonances in kHz of a block of aluminium of 11.92 x 10.93 x 9.86 mm, 2788 kg/m3, as measured by
// Ogi, Sato, Asada and Hirao (2002), "Complete mode identification for resonance ultrasound
// spectroscopy", J. Acoust. Soc. Am. 112, 2553-2557, and its elastic constants c11 = 109.26 GPa,
// c44 = 26.72 GPa, which they found from them. Their own computation is up to 0.56 % off what they
// measured, and edges given to 0.01 mm leave another 0.1 %. The block here is twenty times as
// large, since it is heard then.
TEST(SolidModel, ABlockOfAluminiumRingsAsItWasMeasured) {
  constexpr std::array kMeasured = {116.716, 143.783, 158.081, 166.5,   169.523, 177.846, 183.875,
                                    186.047, 190.341, 197.386, 201.133, 207.386, 209.836, 214.753,
                                    223.548, 231.266, 233.538, 234.717, 250.98,  251.256};
  constexpr double kScale = 20.0;
  constexpr double kShear = 26.72e9;
  constexpr double kLame = 109.26e9 - 2.0 * kShear;
  Material aluminium = metal(0.5 * kLame / (kLame + kShear));
  aluminium.density = 2788.0;
  aluminium.youngsModulus = kShear * (3.0 * kLame + 2.0 * kShear) / (kLame + kShear);
  SolidSettings settings;
  settings.accuracy = 1e-3;
  settings.maxModes = std::ssize(kMeasured);
  const SurfaceMesh block = boxMesh(0.5e-3 * kScale * Vec3(11.92, 10.93, 9.86));
  const SolidAnalysis found = analysed(turned(block), aluminium, settings);
  EXPECT_TRUE(found.reachedAccuracy);
  ASSERT_EQ(found.model.modes.size(), kMeasured.size());
  for (std::size_t mode = 0; mode < kMeasured.size(); ++mode) {
    const double measured = 1000.0 * kMeasured[mode] / kScale;
    EXPECT_NEAR(found.model.modes[mode].frequency, measured, 0.007 * measured) << mode;
  }
}

TEST(SolidModel, FrequenciesScaleWithSizeAndStiffness) {
  const SurfaceMesh body = ellipsoidMesh({0.05, 0.03, 0.04}, 3);
  const VectorXd found = frequencies(body, metal(0.3), 1500, 10);
  const auto twice = [](const Vec3& vertex) { return Vec3(2.0 * vertex); };
  EXPECT_LT((frequencies(mapped(body, twice), metal(0.3), 1500, 10) - 0.5 * found).norm(),
            1e-9 * found.norm());
  Material stiffer = metal(0.3);
  stiffer.youngsModulus *= 9.0;
  stiffer.density *= 4.0;
  EXPECT_LT((frequencies(body, stiffer, 1500, 10) - 1.5 * found).norm(), 1e-9 * found.norm());
}

TEST(SolidModel, ABoxRingsTheSameHoweverItIsTurned) {
  const SurfaceMesh body = boxMesh({0.05, 0.03, 0.02});
  const VectorXd found = frequencies(body, metal(0.3), 2000, 10);
  EXPECT_LT((frequencies(turned(body), metal(0.3), 2000, 10) - found).norm(), 1e-9 * found.norm());
}

// ---- The model

TEST(SolidModel, AModelHasTheRigidBodyOfItsSurface) {
  const Vec3 centre(0.1, 0.2, -0.3);
  SurfaceMesh surface = mapped(boxMesh({0.05, 0.03, 0.02}), [&](const Vec3& vertex) {
    return Vec3(kSomeTurn * vertex + centre);
  });
  for (const bool insideOut : {false, true}) {
    if (insideOut) surface = turnedInsideOut(surface);
    const ModalModel model = analysed(surface, metal(0.3), coarse(1000, 5)).model;
    EXPECT_TRUE(validate(model));
    const double mass = 2700.0 * 0.1 * 0.06 * 0.04;
    EXPECT_NEAR(model.mass, mass, 1e-12 * mass);
    EXPECT_LT((model.centreOfMass - centre).norm(), 1e-14);
    const Vec3 squares(0.1 * 0.1, 0.06 * 0.06, 0.04 * 0.04);
    const Vec3 principal = mass / 12.0 * (Vec3::Constant(squares.sum()) - squares);
    const Eigen::Matrix3d expected = kSomeTurn * principal.asDiagonal() * kSomeTurn.transpose();
    EXPECT_LT((model.inertia - expected).norm(), 1e-12 * expected.norm());
    EXPECT_EQ(model.leftOut.rigid, 6u);
    EXPECT_EQ(model.surface, surface);
  }
}

// The inertia of an ellipsoid of semi-axes a, b, c about the first is m (b^2 + c^2) / 5.
TEST(SolidModel, AModelOfARoundBodyHasNearlyItsInertia) {
  const SurfaceMesh surface = ellipsoidMesh({0.05, 0.03, 0.04}, 4);
  const ModalModel model = analysed(surface, metal(0.3), coarse(3000, 1)).model;
  EXPECT_NEAR(model.mass, 2700.0 * signedVolume(surface), kFilled * model.mass);
  EXPECT_LT(model.centreOfMass.norm(), 1e-4 * 0.05);
  const Vec3 expected = model.mass / 5.0 * Vec3(0.0025, 0.0041, 0.0034);
  EXPECT_LT((model.inertia - Eigen::Matrix3d(expected.asDiagonal())).norm(),
            0.005 * expected.norm());
}

// The bending of a free beam is twice as large at the ends as its root mean square.
TEST(SolidModel, ShapesAreOfUnitModalMass) {
  const SurfaceMesh surface = turned(boxMesh({0.2, 0.015, 0.005}));
  const Result<ModalModel> model = solidModalModel(surface, metal(0.33), coarse(4000, 3));
  ASSERT_TRUE(model);
  ASSERT_EQ(model->modes.size(), 3u);
  const double end = 2.0 / std::sqrt(model->mass);
  for (std::size_t vertex = 0; vertex < surface.vertices.size(); ++vertex) {
    const Vec3 inBeam = kSomeTurn.transpose() * model->shape(0, vertex);
    EXPECT_NEAR(std::abs(inBeam.z()), end, 0.01 * end);
    EXPECT_LT(inBeam.head<2>().norm(), 0.1 * end);
  }
}

/// Returns the volume (m^3/N) that a steady force on each vertex displaces, along each axis: by the
/// modes with these frequencies and by the residual.
Eigen::VectorXd displacedVolumes(const ModalModel& model) {
  const Eigen::VectorXd load = outwardLoad(model.surface);
  Eigen::VectorXd volumes = Eigen::VectorXd::Zero(load.size());
  for (std::size_t vertex = 0; vertex < model.surface.vertices.size(); ++vertex)
    volumes.segment<3>(3 * static_cast<Index>(vertex)) = model.residualVolume(vertex);
  for (std::size_t mode = 0; mode < model.modes.size(); ++mode) {
    const Eigen::VectorXd shape =
        Eigen::Map<const Eigen::VectorXf>(
            &model.shapes[mode * static_cast<std::size_t>(load.size())], load.size())
            .cast<double>();
    volumes += shape * (shape.dot(load) / std::pow(2.0 * kPi * model.modes[mode].frequency, 2.0));
  }
  return volumes;
}

// By reciprocity, the volume that a force displaces is how far a pull of 1 Pa on the whole surface
// moves the point along that force: a body of bulk modulus K swells by x / (3 K).
TEST(SolidModel, ResidualAndModesTogetherSwellAsABodyUnderTension) {
  SurfaceMesh plate = boxMesh({0.2, 0.15, 0.03});
  for (int split = 0; split < 4; ++split)
    plate = splitMesh(plate);
  const Material material = metal(0.3);
  const double modulus = material.youngsModulus / (3.0 * (1.0 - 2.0 * 0.3));
  for (const int modes : {4, 30}) {
    const ModalModel model = *solidModalModel(plate, material, coarse(2500, modes));
    ASSERT_FALSE(model.residualVolumes.empty());
    EXPECT_GT(model.residualFrequency, model.modes.back().frequency);
    const Eigen::VectorXd volumes = displacedVolumes(model);
    double error = 0.0;
    double sum = 0.0;
    for (std::size_t vertex = 0; vertex < plate.vertices.size(); ++vertex) {
      const Vec3 swells = (plate.vertices[vertex] - model.centreOfMass) / (3.0 * modulus);
      error += (volumes.segment<3>(3 * static_cast<Index>(vertex)) - swells).squaredNorm();
      sum += swells.squaredNorm();
    }
    EXPECT_LT(std::sqrt(error / sum), 0.05) << modes;
  }
}

// The residual of few modes is that of more modes, and the volumes that those in between displace.
TEST(SolidModel, ResidualOfFewModesHasTheOthersInIt) {
  const SurfaceMesh bar = splitMesh(splitMesh(boxMesh({0.25, 0.03, 0.02})));
  const ModalModel few = *solidModalModel(bar, metal(0.3), coarse(1500, 3));
  const ModalModel many = *solidModalModel(bar, metal(0.3), coarse(1500, 20));
  ASSERT_GT(many.modes.size(), few.modes.size() + 5);
  const Eigen::VectorXd one = displacedVolumes(few);
  EXPECT_LT((one - displacedVolumes(many)).norm(), 1e-4 * one.norm());
  EXPECT_LT(few.residualFrequency, many.residualFrequency);
}

TEST(SolidModel, SaysHowManyAudibleModesItLeftOut) {
  const SurfaceMesh beam = boxMesh({0.2, 0.015, 0.005});
  const SolidAnalysis few = analysed(beam, metal(0.33), coarse(2000, 7));
  EXPECT_EQ(few.model.modes.size(), 7u);
  EXPECT_TRUE(few.counted);
  const SolidAnalysis all = analysed(beam, metal(0.33), coarse(2000, 500));
  EXPECT_EQ(all.modesBeyond, 0);
  EXPECT_EQ(static_cast<Index>(all.model.modes.size()), 7 + few.modesBeyond);
  EXPECT_TRUE(all.counted);
  EXPECT_LT(all.model.modes.back().frequency, kHighestMode);

  const SolidAnalysis none = analysed(boxMesh({0.005, 0.005, 0.005}), metal(0.33), coarse(500, 9));
  EXPECT_TRUE(none.model.modes.empty());
  EXPECT_EQ(none.model.leftOut.rigid, 6u);
}

TEST(SolidModel, RefusesWhatIsNoSolid) {
  const auto refusal = [](const SurfaceMesh& surface, const Material& material,
                          const Progress& progress = {}) {
    const Result<ModalModel> model = solidModalModel(surface, material, coarse(1000, 5), progress);
    return model ? "" : model.error().message;
  };
  const SurfaceMesh box = boxMesh({0.05, 0.03, 0.02});
  EXPECT_THAT(refusal({}, metal(0.3)), HasSubstr("no volume"));
  EXPECT_THAT(refusal(box, metal(0.5)), HasSubstr("Poisson"));
  Material weightless = metal(0.3);
  weightless.density = 0.0;
  EXPECT_THAT(refusal(box, weightless), HasSubstr("density"));
  Material soft = metal(0.3);
  soft.youngsModulus = 0.0;
  EXPECT_THAT(refusal(box, soft), HasSubstr("Young"));
  EXPECT_EQ(refusal(box, metal(0.3), [](std::string_view, double) { return false; }), kCancelled);
}

/// A strip of steel that is bent by a right angle about y: two flat parts and an arc, by the middle
/// of its thickness.
struct BentStrip {
  double flat = 0.075;       // m, length of each part
  double radius = 0.006;     // m, of the arc
  double width = 0.012;      // m
  double thickness = 0.002;  // m

  /// Returns the place at that share of the length, and the normal.
  std::pair<Vec3, Vec3> at(double share) const {
    const double arc = 0.5 * kPi * radius;
    const double along = share * (2.0 * flat + arc);
    if (along <= flat) return {{along - flat, 0.0, 0.0}, Vec3::UnitZ()};
    if (along >= flat + arc) return {{radius, 0.0, along - flat - arc + radius}, -Vec3::UnitX()};
    const double angle = (along - flat) / radius;
    return {{radius * std::sin(angle), 0.0, radius * (1.0 - std::cos(angle))},
            {-std::sin(angle), 0.0, std::cos(angle)}};
  }
  SurfaceMesh mesh() const {
    constexpr std::uint32_t kSections = 80;
    SurfaceMesh mesh;
    for (std::uint32_t section = 0; section <= kSections; ++section) {
      const auto [middle, normal] = at(section / double{kSections});
      for (const auto& [y, up] : {std::pair{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}})
        mesh.vertices.emplace_back(middle + y * width * Vec3::UnitY() + up * thickness * normal);
    }
    const auto addQuad = [&mesh](std::uint32_t a, std::uint32_t b, std::uint32_t c,
                                 std::uint32_t d) {
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a, c, d});
    };
    addQuad(0, 3, 2, 1);
    for (std::uint32_t section = 0; section < kSections; ++section)
      for (std::uint32_t side = 0; side < 4; ++side)
        addQuad(4 * section + side, 4 * section + (side + 1) % 4, 4 * section + (side + 1) % 4 + 4,
                4 * section + side + 4);
    addQuad(4 * kSections, 4 * kSections + 1, 4 * kSections + 2, 4 * kSections + 3);
    return mesh;
  }
  /// The same with a sharp corner, the radius being 0.
  SurfaceMesh sharpMesh() const {
    const double half = 0.5 * thickness;
    const std::array<std::array<double, 2>, 6> outline = {
        {{-flat, -half}, {half, -half}, {half, flat}, {-half, flat}, {-half, half}, {-flat, half}}};
    SurfaceMesh mesh;
    for (const double y : {-0.5 * width, 0.5 * width})
      for (const auto& [x, z] : outline)
        mesh.vertices.emplace_back(x, y, z);
    for (std::uint32_t side = 0; side < 6; ++side) {
      const std::uint32_t next = (side + 1) % 6;
      mesh.triangles.push_back({side, side + 6, next + 6});
      mesh.triangles.push_back({side, next + 6, next});
    }
    for (const auto& [a, b, c] :
         {std::array{0U, 1U, 4U}, {0U, 4U, 5U}, {1U, 2U, 4U}, {2U, 3U, 4U}}) {
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a + 6, c + 6, b + 6});
    }
    return mesh;
  }
  /// Returns the frequencies (Hz) of its bending in its own plane, as a frame of elements of
  /// Euler's beam.
  std::vector<double> inPlane(const Material& material, std::size_t count) const {
    constexpr Index kElements = 96;
    const double area = width * thickness;
    const double stiff = material.youngsModulus * area * thickness * thickness / 12.0;
    Eigen::MatrixXd stiffness = Eigen::MatrixXd::Zero(3 * kElements + 3, 3 * kElements + 3);
    Eigen::MatrixXd mass = stiffness;
    for (Index element = 0; element < kElements; ++element) {
      const Vec3 way = at(static_cast<double>(element + 1) / kElements).first -
                       at(static_cast<double>(element) / kElements).first;
      const double l = way.norm();
      Eigen::Matrix<double, 6, 6> k = Eigen::Matrix<double, 6, 6>::Zero();
      Eigen::Matrix<double, 6, 6> m = k;
      const double stretch = material.youngsModulus * area / l;
      const double own = material.density * area * l;
      k(0, 0) = k(3, 3) = stretch;
      k(0, 3) = k(3, 0) = -stretch;
      m(0, 0) = m(3, 3) = own / 3.0;
      m(0, 3) = m(3, 0) = own / 6.0;
      Eigen::Matrix4d bend;
      bend << 12, 6 * l, -12, 6 * l, 6 * l, 4 * l * l, -6 * l, 2 * l * l, -12, -6 * l, 12, -6 * l,
          6 * l, 2 * l * l, -6 * l, 4 * l * l;
      Eigen::Matrix4d carry;
      carry << 156, 22 * l, 54, -13 * l, 22 * l, 4 * l * l, 13 * l, -3 * l * l, 54, 13 * l, 156,
          -22 * l, -13 * l, -3 * l * l, -22 * l, 4 * l * l;
      const std::array<Index, 4> places = {1, 2, 4, 5};
      for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t j = 0; j < 4; ++j) {
          const auto row = static_cast<Index>(i);
          const auto column = static_cast<Index>(j);
          k(places[i], places[j]) += stiff / (l * l * l) * bend(row, column);
          m(places[i], places[j]) += own / 420.0 * carry(row, column);
        }
      Eigen::Matrix<double, 6, 6> turn = Eigen::Matrix<double, 6, 6>::Identity();
      for (const Index corner : {0, 3}) {
        turn.block<2, 2>(corner, corner) << way.x() / l, way.z() / l, -way.z() / l, way.x() / l;
      }
      stiffness.block<6, 6>(3 * element, 3 * element) += turn.transpose() * k * turn;
      mass.block<6, 6>(3 * element, 3 * element) += turn.transpose() * m * turn;
    }
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> modes(stiffness, mass,
                                                                          Eigen::EigenvaluesOnly);
    std::vector<double> frequencies;
    for (std::size_t mode = 0; mode < count; ++mode)  // after three rigid ones
      frequencies.push_back(std::sqrt(modes.eigenvalues()[static_cast<Index>(mode) + 3]) /
                            (2.0 * kPi));
    return frequencies;
  }
};

// A bend that is finer than a cell is rigid on one grid as on the next, so that nothing changes
// between them: the analysis goes on all the same, and tells what it is off by.
TEST(SolidModel, ABentStripIsAsSureAsItSays) {
  const Material steel{"steel", 7850.0, 210e9, 0.3, 0.9};
  const BentStrip strip;
  const Result<SolidAnalysis> analysis =
      analyseSolid(turned(strip.mesh()), steel, {.grid = {}, .maxModes = 5});
  ASSERT_TRUE(analysis) << analysis.error().message;
  const std::vector<double> theory = strip.inPlane(steel, 3);
  ASSERT_EQ(analysis->model.modes.size(), 5u);
  for (std::size_t mode = 0; mode < theory.size(); ++mode) {
    const Mode& found = analysis->model.modes[mode];
    EXPECT_NEAR(found.frequency / theory[mode], 1.0, 0.01) << mode;
    EXPECT_NEAR(found.frequency / theory[mode], 1.0, found.frequencyError + 2e-3) << mode;
  }
}

// At a sharp corner inside, functions may have a kink: a corner is not as stiff as the cells that
// it lies in are large. The frame's own corner has no size, and so is less stiff by some of its
// thickness over its length.
TEST(SolidModel, AStripWithASharpCornerIsTheFrameThatItIs) {
  const Material steel{"steel", 7850.0, 210e9, 0.3, 0.9};
  const BentStrip strip{.radius = 0.0, .width = 0.006};
  const SolidAnalysis found =
      analysed(turned(strip.sharpMesh()), steel, {.grid = {}, .maxModes = 3});
  EXPECT_TRUE(found.reachedAccuracy);
  EXPECT_LT(found.degreesOfFreedom, 4000U);
  ASSERT_EQ(found.model.modes.size(), 3u);
  for (const double frequency : strip.inPlane(steel, 2)) {
    const Mode& nearest = *std::ranges::min_element(found.model.modes, {}, [&](const Mode& mode) {
      return std::abs(mode.frequency - frequency);
    });
    EXPECT_NEAR(nearest.frequency / frequency, 1.0, strip.thickness / strip.flat);
  }
}

// Stress is singular in the corner inside, so that errors fall slowly, and the changes between two
// grids are small beside what is left: on such a grid 3.5 % and more, which the energy in the cells
// at the corner tells.
TEST(SolidModel, ACupWithASharpCornerInsideIsAsSureAsItSays) {
  test::RevolvedBody cup = test::revolvedBodies()[2];
  for (test::SectionPart& part : cup.section)  // away from the corner, enough for five modes
    if (part.elements > 2) part.elements = 2 * part.elements / 3;
  const Material& ceramic = *findMaterial("ceramic");
  const std::vector<double> expected = test::revolutionFrequencies(cup, ceramic, 5);
  SolidSettings settings;
  settings.grid.degreesOfFreedom = 5000;
  settings.maxModes = 5;
  const SolidAnalysis found = analysed(turned(test::revolvedMesh(cup, 160)), ceramic, settings);
  ASSERT_EQ(found.model.modes.size(), 5u);
  constexpr double kFacets = 4e-4;  // of the circles' 160 sides
  for (std::size_t mode = 0; mode < 5; ++mode) {
    const Mode& computed = found.model.modes[mode];
    EXPECT_LT(computed.frequencyError, 0.12);
    EXPECT_NEAR(computed.frequency / expected[mode], 1.0, 0.025) << mode;
    EXPECT_NEAR(computed.frequency / expected[mode], 1.0, computed.frequencyError + kFacets)
        << mode;
  }
}

}  // namespace
}  // namespace carom
