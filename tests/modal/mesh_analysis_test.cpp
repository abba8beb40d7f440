#include "carom/modal/mesh_analysis.h"

#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "carom/modal/mesh_check.h"
#include "modal/analysis/solid_model.h"
#include "modal/radiation/mode_radiation.h"
#include "tests/audio/meshes.h"
#include "tests/support/temporary_folder.h"

namespace carom::test {
namespace {

using testing::HasSubstr;

const Material& steel() {
  return *findMaterial("steel");
}

/// A bar of 20 x 2 x 1 cm.
SurfaceMesh bar() {
  return boxMesh({0.1, 0.01, 0.005});
}

/// Settings so coarse that tests are fast.
MeshAnalysisSettings coarse() {
  MeshAnalysisSettings settings;
  settings.solid.grid.degreesOfFreedom = 600;
  settings.solid.maxModes = 4;
  settings.shell.maxModes = 4;
  settings.shell.thickness = 1e-3;
  settings.leastVertices = 60;
  settings.radiation = RadiationSettings{.panels = 200, .maxOrder = 4};
  return settings;
}

MeshAnalysisSettings silent() {
  MeshAnalysisSettings settings = coarse();
  settings.radiation.reset();
  return settings;
}

/// A box with a hole: one triangle is missing.
SurfaceMesh openBox() {
  SurfaceMesh mesh = boxMesh({0.1, 0.1, 0.1});
  mesh.triangles.pop_back();
  return mesh;
}

void expectSameBits(const ModalModel& one, const ModalModel& other) {
  EXPECT_EQ(one.material, other.material);
  EXPECT_EQ(one.mass, other.mass);
  EXPECT_EQ(one.centreOfMass, other.centreOfMass);
  EXPECT_EQ(one.inertia, other.inertia);
  EXPECT_EQ(one.surface, other.surface);
  EXPECT_EQ(one.shapes, other.shapes);
  EXPECT_EQ(one.medium.density, other.medium.density);
  EXPECT_EQ(one.medium.speedOfSound, other.medium.speedOfSound);
  ASSERT_EQ(one.modes.size(), other.modes.size());
  for (std::size_t index = 0; index < one.modes.size(); ++index) {
    EXPECT_EQ(one.modes[index].frequency, other.modes[index].frequency);
    EXPECT_EQ(one.modes[index].decayRate, other.modes[index].decayRate);
    EXPECT_EQ(one.modes[index].radiation.volume, other.modes[index].radiation.volume);
    EXPECT_EQ(one.modes[index].radiation.multipoles, other.modes[index].radiation.multipoles);
  }
}

TEST(MeshAnalysis, WhatComesFromTheCacheIsWhatWasComputedBitByBit) {
  const TemporaryFolder folder;
  ModelCache cache(folder.path());
  const auto computed = analyseMesh(bar(), steel(), coarse(), &cache);
  const auto found = analyseMesh(bar(), steel(), coarse(), &cache);
  const auto alone = analyseMesh(bar(), steel(), coarse());
  ASSERT_TRUE(computed) << computed.error().message;
  ASSERT_TRUE(found && alone);
  EXPECT_FALSE(computed->isFromCache);
  EXPECT_TRUE(found->isFromCache);
  EXPECT_FALSE(alone->isFromCache);
  EXPECT_EQ(folder.entries(), 1u);
  ASSERT_EQ(computed->model.modes.size(), 4u);
  expectSameBits(computed->model, found->model);
  expectSameBits(computed->model, alone->model);
}

TEST(MeshAnalysis, EverySettingThatChangesTheResultIsAnotherKey) {
  const std::vector<std::function<void(MeshAnalysisSettings&)>> changes = {
      [](auto& settings) { settings.solid.grid.degreesOfFreedom = 700; },
      [](auto& settings) { settings.solid.maxModes = 3; },
      [](auto& settings) { settings.leastVertices = 70; },
      [](auto& settings) { settings.mostVertices = 2000; },
      [](auto& settings) { settings.medium.density = 1.1; },
      [](auto& settings) { settings.medium.speedOfSound = 340.0; },
      [](auto& settings) { settings.radiation = RadiationSettings{.panels = 240, .maxOrder = 4}; },
      [](auto& settings) { settings.radiation = RadiationSettings{.panels = 200, .maxOrder = 3}; },
      [](auto& settings) { settings.body = BodyModel::shell; },
      [](auto& settings) {
        settings.body = BodyModel::shell;
        settings.shell.thickness = 2e-3;
      }};
  const TemporaryFolder folder;
  ModelCache cache(folder.path());
  ASSERT_TRUE(analyseMesh(bar(), steel(), coarse(), &cache));
  std::size_t stored = 1;
  for (const auto& change : changes) {
    MeshAnalysisSettings settings = coarse();
    change(settings);
    const auto analysis = analyseMesh(bar(), steel(), settings, &cache);
    ASSERT_TRUE(analysis) << analysis.error().message;
    EXPECT_FALSE(analysis->isFromCache) << stored;
    EXPECT_EQ(folder.entries(), ++stored);
  }
  const auto other = analyseMesh(bar(), *findMaterial("brass"), coarse(), &cache);
  ASSERT_TRUE(other);
  EXPECT_FALSE(other->isFromCache);
  const auto longer = analyseMesh(boxMesh({0.11, 0.01, 0.005}), steel(), coarse(), &cache);
  ASSERT_TRUE(longer);
  EXPECT_FALSE(longer->isFromCache);
  EXPECT_EQ(folder.entries(), stored + 2);
}

// As models of other programs' files may have it.
TEST(MeshAnalysis, RadiationIsAboutTheCentreOfMassThatAModelHas) {
  const TemporaryFolder folder;
  ModelCache cache(folder.path());
  auto analysis = analyseMesh(ellipsoidMesh({0.08, 0.05, 0.03}, 2), steel(), silent());
  ASSERT_TRUE(analysis);
  for (Mode& mode : analysis->model.modes)
    mode.radiation = {};
  const RadiationSettings settings{.panels = 400, .maxOrder = 4};
  ModalModel centred = analysis->model;
  ASSERT_TRUE(addRadiation(centred, settings, &cache));
  ModalModel other = analysis->model;
  other.centreOfMass.x() += 0.02;
  ModalModel alone = other;
  ASSERT_TRUE(addRadiation(other, settings, &cache));
  ASSERT_TRUE(addRadiation(alone, settings));
  expectSameBits(other, alone);
  EXPECT_NE(other.modes.front().radiation.multipoles, centred.modes.front().radiation.multipoles);
}

TEST(MeshAnalysis, SettingsOfTheOtherModelOfBodiesAreNotAskedFor) {
  const TemporaryFolder folder;
  ModelCache cache(folder.path());
  MeshAnalysisSettings settings = silent();
  ASSERT_TRUE(analyseMesh(bar(), steel(), settings, &cache));
  settings.shell.thickness = 5e-3;
  EXPECT_TRUE(analyseMesh(bar(), steel(), settings, &cache)->isFromCache);
  settings.body = BodyModel::shell;
  ASSERT_TRUE(analyseMesh(bar(), steel(), settings, &cache));
  settings.solid.grid.degreesOfFreedom = 900;
  EXPECT_TRUE(analyseMesh(bar(), steel(), settings, &cache)->isFromCache);
}

TEST(MeshAnalysis, ACacheThatCannotBeWrittenIsNoError) {
  ModelCache cache("/dev/null/no_folder");
  const auto analysis = analyseMesh(bar(), steel(), silent(), &cache);
  ASSERT_TRUE(analysis);
  EXPECT_FALSE(analysis->isFromCache);
}

TEST(MeshAnalysis, AnOpenSurfaceIsNoSolidAndTheErrorIsNeedSolids) {
  const auto analysis = analyseMesh(openBox(), steel(), silent());
  ASSERT_FALSE(analysis);
  EXPECT_EQ(analysis.error().message, needSolid(checkMesh(openBox())).error().message);
  EXPECT_THAT(analysis.error().message, HasSubstr("open"));
  MeshAnalysisSettings shell = silent();
  shell.body = BodyModel::shell;
  const auto sheet = analyseMesh(openBox(), steel(), shell);
  ASSERT_TRUE(sheet) << sheet.error().message;
  ASSERT_EQ(sheet->findings.size(), 1u);
  EXPECT_EQ(sheet->findings[0].fault, MeshFault::open);
}

TEST(MeshAnalysis, AMeshThatIsNoneIsRefusedWhateverTheModelOfBodies) {
  SurfaceMesh badIndex = bar();
  badIndex.triangles[0][0] = 99;
  SurfaceMesh notFinite = bar();
  notFinite.vertices[3].y() = std::nan("");
  for (const SurfaceMesh& mesh : {SurfaceMesh{}, badIndex, notFinite}) {
    for (const BodyModel body : {BodyModel::solid, BodyModel::shell}) {
      MeshAnalysisSettings settings = silent();
      settings.body = body;
      const auto analysis = analyseMesh(mesh, steel(), settings);
      ASSERT_FALSE(analysis);
      EXPECT_EQ(analysis.error().message, checkMesh(mesh).findings.at(0).text);
    }
  }
}

TEST(MeshAnalysis, InsideOutIsMendedAndSaid) {
  const auto analysis = analyseMesh(turnedInsideOut(bar()), steel(), silent());
  const auto straight = analyseMesh(bar(), steel(), silent());
  ASSERT_TRUE(analysis && straight);
  ASSERT_EQ(analysis->findings.size(), 1u);
  EXPECT_EQ(analysis->findings[0].fault, MeshFault::insideOut);
  EXPECT_TRUE(straight->findings.empty());
  EXPECT_NEAR(analysis->model.modes.at(0).frequency, straight->model.modes.at(0).frequency, 1e-6);
}

TEST(MeshAnalysis, ACoarseMeshGetsVerticesAndAFineOneLosesThem) {
  MeshAnalysisSettings settings = silent();
  ASSERT_EQ(bar().vertices.size(), 8u);
  settings.leastVertices = 300;
  const auto refined = analyseMesh(bar(), steel(), settings);
  ASSERT_TRUE(refined);
  EXPECT_GE(refined->model.surface.vertices.size(), 300u);
  EXPECT_NEAR(signedVolume(refined->model.surface), 0.2 * 0.02 * 0.01, 1e-15);
  const SurfaceMesh fine = ellipsoidMesh({0.1, 0.02, 0.02}, 4);
  settings.mostVertices = 200;
  ASSERT_GT(fine.vertices.size(), 200u);
  const auto simple = analyseMesh(fine, steel(), settings);
  ASSERT_TRUE(simple) << simple.error().message;
  EXPECT_LE(simple->model.surface.vertices.size(), 200u);
  EXPECT_GE(simple->model.surface.vertices.size(), 100u);
}

// Both calculations assume that the motion is linear between a triangle's corners.
TEST(MeshAnalysis, WithoutRadiationVolumesAreThoseThatItWouldHaveFound) {
  MeshAnalysisSettings settings = silent();
  const SurfaceMesh shape = ellipsoidMesh({0.08, 0.05, 0.03}, 2);
  const auto without = analyseMesh(shape, steel(), settings);
  settings.radiation = RadiationSettings{.panels = 400, .maxOrder = 4};
  const auto with = analyseMesh(shape, steel(), settings);
  ASSERT_TRUE(without && with);
  ASSERT_EQ(without->model.modes.size(), with->model.modes.size());
  EXPECT_FALSE(without->radiation);
  EXPECT_TRUE(with->radiation);
  double loudest = 0.0;
  for (const Mode& mode : with->model.modes)
    loudest = std::max(loudest, std::abs(mode.radiation.volume));
  ASSERT_GT(loudest, 0.0);
  for (std::size_t index = 0; index < with->model.modes.size(); ++index) {
    EXPECT_TRUE(without->model.modes[index].radiation.multipoles.empty());
    EXPECT_FALSE(with->model.modes[index].radiation.multipoles.empty());
    EXPECT_NEAR(without->model.modes[index].radiation.volume,
                with->model.modes[index].radiation.volume, 0.03 * loudest);
  }
}

TEST(MeshAnalysis, ABodyTooSmallAndStiffToBeHeardHasNoModes) {
  const auto analysis = analyseMesh(boxMesh({0.005, 0.005, 0.005}), steel(), coarse());
  ASSERT_TRUE(analysis) << analysis.error().message;
  EXPECT_TRUE(analysis->model.modes.empty());
  EXPECT_TRUE(analysis->model.shapes.empty());
  EXPECT_NEAR(analysis->model.mass, 1e-6 * steel().density, 1e-9);
}

TEST(MeshAnalysis, ProgressGoesFromBeginToEndAndCanStopIt) {
  std::vector<double> shares;
  ASSERT_TRUE(analyseMesh(bar(), steel(), coarse(), nullptr, [&](std::string_view, double share) {
    shares.push_back(share);
    return true;
  }));
  ASSERT_FALSE(shares.empty());
  EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
  EXPECT_GE(shares.front(), 0.0);
  EXPECT_LE(shares.back(), 1.0);
  const TemporaryFolder folder;
  ModelCache cache(folder.path());
  const auto stopped =
      analyseMesh(bar(), steel(), coarse(), &cache, [](std::string_view, double) { return false; });
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().message, kCancelled);
  EXPECT_EQ(folder.entries(), 0u);
}

}  // namespace
}  // namespace carom::test
