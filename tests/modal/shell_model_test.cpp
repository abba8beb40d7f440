#include "modal/analysis/shell_model.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/audio/meshes.h"
#include "tests/support/random.h"

namespace carom::test {

using namespace modal;

namespace {

using std::numbers::pi;
using testing::ElementsAre;
using testing::HasSubstr;

Material undamped(double density, double youngsModulus) {
  return {"test", density, youngsModulus, 0.3, 0.9, 0.0, 0.0};
}

/// Settings that neither simplify nor subdivide the mesh.
ShellSettings asItIs(ShellSprings springs, double thickness = 1e-3) {
  return {.thickness = thickness,
          .springs = springs,
          .minVertices = 0,
          .maxVertices = 3000,
          .maxModes = 3000};
}

SurfaceMesh tetrahedron(double half) {
  return {{{half, half, half}, {half, -half, -half}, {-half, half, -half}, {-half, -half, half}},
          {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}}};
}

SurfaceMesh octahedron(double reach) {
  return {
      {{reach, 0, 0}, {-reach, 0, 0}, {0, reach, 0}, {0, -reach, 0}, {0, 0, reach}, {0, 0, -reach}},
      {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}};
}

SurfaceMesh icosahedron(double scale) {
  const double golden = scale * std::numbers::phi;
  SurfaceMesh mesh;
  for (const double one : {-scale, scale})
    for (const double tall : {-golden, golden})
      mesh.vertices.insert(mesh.vertices.end(),
                           {{0.0, one, tall}, {one, tall, 0.0}, {tall, 0.0, one}});
  const auto near = [&](std::uint32_t i, std::uint32_t j) {
    return (mesh.vertices[i] - mesh.vertices[j]).norm() < 2.01 * scale;
  };
  for (std::uint32_t i = 0; i < 12; ++i)
    for (std::uint32_t j = i + 1; j < 12; ++j)
      for (std::uint32_t k = j + 1; k < 12; ++k)
        if (near(i, j) && near(j, k) && near(k, i)) mesh.triangles.push_back({i, j, k});
  return mesh;
}

/// A flat sheet of columns x rows vertices, each square in two triangles.
SurfaceMesh sheet(std::uint32_t columns, std::uint32_t rows, double spacing) {
  SurfaceMesh mesh;
  for (std::uint32_t row = 0; row < rows; ++row)
    for (std::uint32_t column = 0; column < columns; ++column)
      mesh.vertices.emplace_back(spacing * column, spacing * row, 0.0);
  for (std::uint32_t row = 0; row + 1 < rows; ++row) {
    for (std::uint32_t column = 0; column + 1 < columns; ++column) {
      const std::uint32_t first = row * columns + column;
      mesh.triangles.push_back({first, first + 1, first + columns + 1});
      mesh.triangles.push_back({first, first + columns + 1, first + columns});
    }
  }
  return mesh;
}

/// A tube of rings with `around` vertices, open at both ends.
SurfaceMesh tube(std::uint32_t around, std::uint32_t rings, double radius, double spacing) {
  SurfaceMesh mesh;
  for (std::uint32_t ring = 0; ring < rings; ++ring)
    for (std::uint32_t k = 0; k < around; ++k)
      mesh.vertices.emplace_back(radius * std::cos(2.0 * pi * k / around),
                                 radius * std::sin(2.0 * pi * k / around), spacing * ring);
  for (std::uint32_t ring = 0; ring + 1 < rings; ++ring) {
    for (std::uint32_t k = 0; k < around; ++k) {
      const std::uint32_t here = ring * around + k;
      const std::uint32_t next = ring * around + (k + 1) % around;
      mesh.triangles.push_back({here, next, next + around});
      mesh.triangles.push_back({here, next + around, here + around});
    }
  }
  return mesh;
}

ModalModel modelOf(const SurfaceMesh& mesh, const Material& material,
                   const ShellSettings& settings) {
  const auto model = shellModalModel(mesh, material, settings);
  EXPECT_TRUE(model) << model.error().message;
  return model ? *model : ModalModel{};
}

/// Eigenvalues in rad^2/s^2.
std::vector<double> lambdasOf(const ModalModel& model) {
  std::vector<double> lambdas;
  for (const Mode& mode : model.modes)
    lambdas.push_back(std::pow(2.0 * pi * mode.frequency, 2.0));
  return lambdas;
}

/// Expects these eigenvalues, in units of k / m, as the literature has them.
void expectSpectrum(const SurfaceMesh& mesh, ShellSprings springs,
                    const std::vector<double>& expected) {
  const Material material = undamped(2000.0, 2e6);
  const ModalModel model = modelOf(mesh, material, asItIs(springs));
  const double mass = 2000.0 * 1e-3 * surfaceArea(mesh) / static_cast<double>(mesh.vertices.size());
  std::vector<double> found = lambdasOf(model);
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t mode = 0; mode < found.size(); ++mode)
    EXPECT_NEAR(found[mode] * mass / (2e6 * 1e-3), expected[mode], 1e-9) << mode;
}

// ---- Transverse springs

// The spectra are those of the Laplacians of regular solids' graphs (Cvetkovic, Doob, Sachs,
// "Spectra of Graphs", 1980); all vertices have the same mass.
TEST(ShellModel, RegularSolidsHaveTheSpectraOfTheirGraphs) {
  const double root = std::sqrt(5.0);
  expectSpectrum(tetrahedron(0.05), ShellSprings::transverse, {4, 4, 4});
  expectSpectrum(octahedron(0.05), ShellSprings::transverse, {4, 4, 4, 6, 6});
  expectSpectrum(icosahedron(0.05), ShellSprings::transverse,
                 {5 - root, 5 - root, 5 - root, 6, 6, 6, 6, 6, 5 + root, 5 + root, 5 + root});
}

// Modes that are equal all around a tube are those of a chain with two springs from each mass to
// the next and half a mass at each end: lambda = 8 k/m sin^2(pi n / (2 (N - 1))), exactly.
TEST(ShellModel, ATubeHasTheModesOfAChain) {
  const std::uint32_t around = 12;
  const std::uint32_t rings = 9;
  const double radius = 0.05;
  const double spacing = 0.02;
  const ModalModel model = modelOf(tube(around, rings, radius, spacing), undamped(2000.0, 2e6),
                                   asItIs(ShellSprings::transverse));
  const std::vector<double> found = lambdasOf(model);
  const double width = 2.0 * radius * std::sin(pi / around);
  const double ratio = 2e6 / (2000.0 * width * spacing);  // k / m inside
  for (std::uint32_t n = 1; n < rings; ++n) {
    const double expected = 8.0 * ratio * std::pow(std::sin(pi * n / (2.0 * (rings - 1))), 2.0);
    const auto near = [&](double lambda) { return std::abs(lambda / expected - 1.0) < 1e-9; };
    EXPECT_TRUE(std::ranges::any_of(found, near)) << n;
  }
  EXPECT_EQ(model.leftOut.rigid, 1u);
}

// The expected energy adds the springs between the vertices of each edge one by one, without any of
// the code's tables.
TEST(ShellModel, AnyMeshAgreesWithEnergiesAddedUpByHand) {
  Random random(3);
  const SurfaceMesh mesh = mapped(ellipsoidMesh({0.1, 0.07, 0.05}, 2), [&](const Vec3& vertex) {
    return Vec3(vertex + 0.002 * random.inCube());
  });
  const auto count = static_cast<Eigen::Index>(mesh.vertices.size());
  const auto network = shellNetwork(mesh, undamped(2500.0, 5e9), asItIs(ShellSprings::axial, 2e-3));
  ASSERT_TRUE(network) << network.error().message;
  for (int trial = 0; trial < 10; ++trial) {
    Eigen::VectorXd moved(3 * count);
    for (double& value : moved)
      value = random.between(-1.0, 1.0);
    // Each edge of a closed surface belongs to two triangles.
    double energy = 0.0;
    for (const auto& triangle : mesh.triangles) {
      for (std::size_t side = 0; side < 3; ++side) {
        const auto from = triangle[side];
        const auto to = triangle[(side + 1) % 3];
        const Vec3 along = (mesh.vertices[to] - mesh.vertices[from]).normalized();
        const double longer = along.dot(moved.segment<3>(3 * Eigen::Index{to}) -
                                        moved.segment<3>(3 * Eigen::Index{from}));
        energy += 0.5 * 0.5 * (5e9 * 2e-3) * longer * longer;
      }
    }
    EXPECT_NEAR(0.5 * moved.dot(network->stiffness * moved), energy, 1e-9 * energy);
  }
  EXPECT_NEAR(network->masses.sum(), 2500.0 * 2e-3 * surfaceArea(mesh), 1e-12);
}

// m and k are both proportional to the thickness.
TEST(ShellModel, FrequenciesDoNotDependOnTheThickness) {
  const SurfaceMesh mesh = ellipsoidMesh({0.1, 0.07, 0.05}, 2);
  for (const ShellSprings springs : {ShellSprings::transverse, ShellSprings::axial}) {
    const auto thin = lambdasOf(modelOf(mesh, undamped(2500, 5e7), asItIs(springs, 1e-3)));
    const auto thick = lambdasOf(modelOf(mesh, undamped(2500, 5e7), asItIs(springs, 4e-3)));
    ASSERT_EQ(thin.size(), thick.size());
    for (std::size_t mode = 0; mode < thin.size(); ++mode)
      EXPECT_NEAR(thick[mode], thin[mode], 1e-8 * thin[mode]);
  }
}

TEST(ShellModel, FrequenciesGoWithTheRootOfStiffnessOverDensityAndInverselyWithSize) {
  const SurfaceMesh mesh = ellipsoidMesh({0.1, 0.07, 0.05}, 2);
  const SurfaceMesh larger = mapped(mesh, [](const Vec3& vertex) { return Vec3(3.0 * vertex); });
  for (const ShellSprings springs : {ShellSprings::transverse, ShellSprings::axial}) {
    const ModalModel base = modelOf(mesh, undamped(2500, 1e8), asItIs(springs));
    const ModalModel stiff = modelOf(mesh, undamped(2500, 4e8), asItIs(springs));
    const ModalModel dense = modelOf(mesh, undamped(2500 * 9, 1e8), asItIs(springs));
    const ModalModel large = modelOf(larger, undamped(2500, 1e8), asItIs(springs));
    ASSERT_FALSE(base.modes.empty());
    const double first = base.modes[0].frequency;
    EXPECT_NEAR(stiff.modes[0].frequency, 2.0 * first, 1e-6 * first);
    EXPECT_NEAR(dense.modes[0].frequency, first / 3.0, 1e-6 * first);
    EXPECT_NEAR(large.modes[0].frequency, first / 3.0, 1e-6 * first);
  }
}

// ---- Axial springs

// Four masses joined by six equal springs have a breathing mode at 4 k/m, three modes at 2, two at
// 1 (Herzberg, "Infrared and Raman Spectra", 1945: a tetrahedral X4 molecule of central forces).
TEST(ShellModel, ATetrahedronOfSpringsVibratesLikeAMolecule) {
  expectSpectrum(tetrahedron(0.05), ShellSprings::axial, {1, 1, 2, 2, 2, 4});
}

// A convex polyhedron of triangles is rigid (Dehn 1916): only the six motions of the whole body
// cost no energy.
TEST(ShellModel, AConvexBodyHasSixRigidModes) {
  for (const SurfaceMesh& mesh : {tetrahedron(0.05), octahedron(0.05), icosahedron(0.05),
                                  ellipsoidMesh({0.1, 0.07, 0.05}, 2)}) {
    const ModalModel model = modelOf(mesh, undamped(2500, 1e8), asItIs(ShellSprings::axial));
    EXPECT_EQ(model.leftOut.rigid, 6u);
    EXPECT_EQ(model.modes.size() + model.leftOut.below + model.leftOut.above,
              3 * mesh.vertices.size() - 6);
  }
}

// Out of the plane every vertex of a sheet is free; in the plane the sheet is rigid. A vertex
// inside a flat side of a box is free to leave it, too.
TEST(ShellModel, WhatIsFlatIsFloppyAndNotSounded) {
  const SurfaceMesh flat = sheet(7, 5, 0.02);
  const ModalModel model = modelOf(flat, undamped(2500, 1e8), asItIs(ShellSprings::axial));
  EXPECT_EQ(model.leftOut.rigid, 35u + 3u);
  for (std::size_t mode = 0; mode < model.modes.size(); ++mode)
    for (std::size_t vertex = 0; vertex < 35; ++vertex)
      EXPECT_NEAR(model.shape(mode, vertex).z(), 0.0, 1e-5);
  const ModalModel membrane = modelOf(flat, undamped(2500, 1e8), asItIs(ShellSprings::transverse));
  EXPECT_EQ(membrane.leftOut.rigid, 1u);
  EXPECT_EQ(membrane.modes.size() + membrane.leftOut.above, 34u);
}

// ---- The model

TEST(ShellModel, ShapesAreNormalisedByMassAndAlongTheNormals) {
  const SurfaceMesh mesh = icosahedron(0.05);  // its normals are radial
  const Material material = undamped(2500, 5e7);
  for (const ShellSprings springs : {ShellSprings::transverse, ShellSprings::axial}) {
    const ModalModel model = modelOf(mesh, material, asItIs(springs));
    const auto network = shellNetwork(mesh, material, asItIs(springs));
    ASSERT_TRUE(network);
    EXPECT_TRUE(validate(model));
    for (std::size_t mode = 0; mode < model.modes.size(); ++mode) {
      double norm = 0.0;
      for (std::size_t vertex = 0; vertex < mesh.vertices.size(); ++vertex) {
        const Vec3 shape = model.shape(mode, vertex);
        norm += network->masses[static_cast<Eigen::Index>(vertex)] * shape.squaredNorm();
        if (springs == ShellSprings::transverse) {
          EXPECT_LT(shape.cross(mesh.vertices[vertex]).norm(), 1e-6 * shape.norm() + 1e-9);
        }
      }
      EXPECT_NEAR(norm, 1.0, 1e-5);
    }
  }
}

// A hollow cube of side a consists of six plates of m a^2 (1/12 + 1/12 + ...), together 5/18 M a^2.
TEST(ShellModel, MassAndInertiaAreThoseOfTheHollowBody) {
  const double side = 0.2;
  const Vec3 far(1.0, 2.0, 3.0);
  const SurfaceMesh cube = mapped(boxMesh(Vec3::Constant(0.5 * side)),
                                  [&](const Vec3& vertex) { return Vec3(vertex + far); });
  ShellSettings settings;
  settings.thickness = 1e-3;
  const ModalModel model = modelOf(cube, undamped(1000.0, 1e9), settings);
  const double mass = 1000.0 * 1e-3 * 6.0 * side * side;
  EXPECT_NEAR(model.mass, mass, 1e-12);
  EXPECT_LT((model.centreOfMass - far).norm(), 1e-12);
  const Eigen::Matrix3d inertia = 5.0 / 18.0 * mass * side * side * Eigen::Matrix3d::Identity();
  EXPECT_LT((model.inertia - inertia).norm(), 1e-12);
  EXPECT_GE(model.surface.vertices.size(), settings.minVertices);
  EXPECT_TRUE(closedSurface(model.surface));
}

TEST(ShellModel, ADoubleSidedSheetSoundsLikeASingleOne) {
  const SurfaceMesh one = sheet(6, 6, 0.02);
  SurfaceMesh both = one;
  for (const auto& [a, b, c] : one.triangles)
    both.triangles.push_back({a, c, b});
  const Material material = undamped(2500, 1e8);
  const ModalModel single = modelOf(one, material, asItIs(ShellSprings::transverse));
  const ModalModel twice = modelOf(both, material, asItIs(ShellSprings::transverse));
  EXPECT_NEAR(twice.mass, single.mass, 1e-12);
  ASSERT_EQ(twice.modes.size(), single.modes.size());
  EXPECT_NEAR(twice.modes[0].frequency, single.modes[0].frequency, 1e-6);
}

TEST(ShellModel, KeepsTheLowestModesAskedFor) {
  const SurfaceMesh mesh = ellipsoidMesh({0.1, 0.07, 0.05}, 2);
  ShellSettings few = asItIs(ShellSprings::axial);
  const auto all = lambdasOf(modelOf(mesh, undamped(2500, 1e8), few));
  few.maxModes = 5;
  const auto five = lambdasOf(modelOf(mesh, undamped(2500, 1e8), few));
  ASSERT_EQ(five.size(), 5u);
  for (std::size_t mode = 0; mode < 5; ++mode)
    EXPECT_NEAR(five[mode], all[mode], 1e-9 * all[mode]);
}

TEST(ShellModel, DenseMeshesAreSimplifiedFirst) {
  ShellSettings settings;
  settings.minVertices = 100;
  settings.maxVertices = 200;
  const SurfaceMesh ball = ellipsoidMesh(Vec3::Constant(0.1), 4);
  const auto network = shellNetwork(ball, undamped(2500, 1e9), settings);
  ASSERT_TRUE(network) << network.error().message;
  EXPECT_LE(network->surface.vertices.size(), 200u);
  EXPECT_TRUE(closedSurface(network->surface));
}

// ---- Refused surfaces and settings

std::string refusal(const SurfaceMesh& mesh, const ShellSettings& settings,
                    const Material& material = undamped(2500, 1e9)) {
  const auto model = shellModalModel(mesh, material, settings);
  return model ? "" : model.error().message;
}

TEST(ShellModel, SaysWhatIsWrong) {
  const SurfaceMesh box = boxMesh(Vec3::Constant(0.05));
  EXPECT_THAT(refusal(box, {.thickness = 0.0}), HasSubstr("thickness must be positive"));
  EXPECT_THAT(refusal(box, {.thickness = 0.1}), HasSubstr("is not less than the whole body's"));
  EXPECT_THAT(refusal(box, {.maxModes = 0}), HasSubstr("at least 1 mode"));
  EXPECT_THAT(refusal(box, {.minVertices = 9, .maxVertices = 8}), HasSubstr("9, is above"));
  EXPECT_THAT(refusal({}, {}), HasSubstr("no triangles"));
  EXPECT_THAT(refusal(box, {}, undamped(-1.0, 1e9)), HasSubstr("shell: material 'test': "));
  EXPECT_THAT(refusal(ellipsoidMesh(Vec3::Ones(), 5), asItIs(ShellSprings::axial)),
              HasSubstr("degrees of freedom are too many; expected at most 3000"));
}

TEST(ShellModel, CanBeCancelledAndTellsItsStages) {
  const SurfaceMesh box = boxMesh(Vec3::Constant(0.05));
  std::vector<std::string> stages;
  const auto all =
      shellModalModel(box, undamped(2500, 1e9), {}, [&](std::string_view stage, double) {
        stages.emplace_back(stage);
        return true;
      });
  EXPECT_TRUE(all);
  EXPECT_THAT(stages, ElementsAre("springs", "modes", "modes"));
  const auto none =
      shellModalModel(box, undamped(2500, 1e9), {}, [](std::string_view, double) { return false; });
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().message, kCancelled);
}

}  // namespace
}  // namespace carom::test
