#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "carom/modal/gltf_audio.h"
#include "modal/analysis/audible_modes.h"
#include "tests/support/temporary_folder.h"

namespace carom::test {

using namespace modal;

namespace {

using testing::HasSubstr;
using testing::SizeIs;

/// Largest relative error of a float: half a unit in its last place.
constexpr double kFloat = 6e-8;

/// A tetrahedron with legs of 1 m, whose volume and centroid are known.
SurfaceMesh corner() {
  return {{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)},
          {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};
}

ModalModel glassCorner() {
  ModalModel model;
  model.name = "corner";
  model.material = *findMaterial("glass");
  model.mass = 0.3;
  model.centreOfMass = {0.1, 0.2, 1.0 / 3.0};
  model.inertia << 3.0, 0.5, -0.25, 0.5, 4.0, 0.125, -0.25, 0.125, 5.0;
  model.surface = corner();
  model.modes = {{100.0, 3.0, {-1e-3, {}}}, {1000.0 / 3.0, 2000.0, {2.0, {}}}, {19000.0, 0.0, {}}};
  for (int value = 0; value < 36; ++value)
    model.shapes.push_back(static_cast<float>(value) / 7.0F);
  model.leftOut = {6, 5, 4, 3};
  return model;
}

/// A model of one point, in the form of the draft.
GltfAudio onePoint(std::vector<float> frequencies, std::vector<float> decayRates) {
  GltfAudio audio;
  GltfModalModel& model = audio.models.emplace_back();
  model.positions = {Eigen::Vector3f::Zero()};
  for (std::size_t mode = 0; mode < frequencies.size(); ++mode)
    model.shapes.emplace_back(static_cast<float>(mode), 0.0F, 0.0F);
  model.frequencies = std::move(frequencies);
  model.decayRates = std::move(decayRates);
  model.massProperties.emplace().mass = 1.0;
  return audio;
}

TEST(GltfModalModel, ComesBackThroughAFile) {
  const TemporaryFolder folder;
  const ModalModel model = glassCorner();
  GltfAudio audio;
  addModalModel(audio, model);
  ASSERT_TRUE(validate(audio));
  ASSERT_TRUE(writeGltfAudio(folder / "corner.glb", audio));
  const auto read = readGltfAudio(folder / "corner.glb");
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_THAT(read->nodes, SizeIs(1));
  ASSERT_EQ(read->nodes[0].modalModel, 0u);
  const auto again = toModalModel(*read, 0, 1.0, *findMaterial("rubber"));
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->name, "corner");
  EXPECT_EQ(again->material.name, "glass");
  EXPECT_EQ(again->material.density, model.material.density);
  EXPECT_EQ(again->material.youngsModulus, model.material.youngsModulus);
  EXPECT_EQ(again->material.poissonsRatio, model.material.poissonsRatio);
  EXPECT_EQ(again->material.restitution, model.material.restitution);
  EXPECT_EQ(again->material.dampingAlpha, model.material.dampingAlpha);
  EXPECT_EQ(again->material.dampingBeta, model.material.dampingBeta);
  EXPECT_EQ(again->mass, model.mass);
  EXPECT_EQ(again->centreOfMass, model.centreOfMass);
  EXPECT_TRUE(again->inertia.isApprox(model.inertia, 1e-14)) << again->inertia;
  EXPECT_EQ(again->surface, model.surface);
  EXPECT_EQ(again->shapes, model.shapes);
  EXPECT_EQ(again->leftOut.rigid, 6u);
  EXPECT_EQ(again->leftOut.below, 5u);
  EXPECT_EQ(again->leftOut.above, 4u);
  EXPECT_EQ(again->leftOut.overdamped, 3u);
  ASSERT_THAT(again->modes, SizeIs(3));
  const bool hasMultipoles = std::ranges::any_of(
      model.modes, [](const Mode& mode) { return !mode.radiation.multipoles.empty(); });
  for (std::size_t mode = 0; mode < 3; ++mode) {
    EXPECT_NEAR(again->modes[mode].frequency, model.modes[mode].frequency,
                kFloat * model.modes[mode].frequency);
    EXPECT_NEAR(again->modes[mode].decayRate, model.modes[mode].decayRate,
                kFloat * model.modes[mode].decayRate);
    EXPECT_EQ(again->modes[mode].radiation.volume,
              hasMultipoles ? 0.0 : model.modes[mode].radiation.volume);
  }
}

// The draft's appendix A by hand: for lambda = 9e6 rad^2/s^2, alpha = 100 1/s and beta = 4e-4 s
// omega is 3000 rad/s, d = (100 + 4e-4 * 9e6) / 2 = 1850 1/s, and the audible frequency sqrt(9e6 -
// 1850^2) / (2 pi) Hz.
TEST(GltfModalModel, WritesTheFrequencyThatIsHeard) {
  ModalModel model;
  model.material = *findMaterial("glass");
  model.material.dampingAlpha = 100.0;
  model.material.dampingBeta = 4e-4;
  model.mass = 1.0;
  model.surface.vertices = {Vec3::Zero()};
  EigenModes found;
  found.lambda = Eigen::VectorXd::Constant(1, 9e6);
  found.shapes = Eigen::MatrixXd::Ones(3, 1);
  keepAudibleModes(model, found, 1.0);
  GltfAudio audio;
  addModalModel(audio, model);
  ASSERT_THAT(audio.models[0].frequencies, SizeIs(1));
  EXPECT_NEAR(audio.models[0].frequencies[0], 375.8720, 1e-4);
  EXPECT_NEAR(audio.models[0].decayRates[0], 1850.0, 1e-3);
}

TEST(GltfModalModel, SortsModesAndCountsThoseThatAreNotHeard) {
  const GltfAudio audio =
      onePoint({5000.0F, 10.0F, 50.0F, 30000.0F, 21.0F}, {1.0F, 0.0F, 2.0F, 1.0F, 1e12F});
  const auto model = toModalModel(audio, 0, 1.0, *findMaterial("glass"));
  ASSERT_TRUE(model) << model.error().message;
  ASSERT_THAT(model->modes, SizeIs(2));
  EXPECT_NEAR(model->modes[0].frequency, 50.0010132, 1e-7);  // 4 / (4 pi * 100 pi) more than 50
  EXPECT_EQ(model->modes[0].decayRate, 2.0);
  EXPECT_EQ(model->shape(0, 0), Vec3(2, 0, 0));
  EXPECT_NEAR(model->modes[1].frequency, 5000.0, 1e-3);
  EXPECT_EQ(model->shape(1, 0), Vec3(0, 0, 0));
  EXPECT_EQ(model->leftOut.below, 1u);
  EXPECT_EQ(model->leftOut.above, 2u);  // undamped, the mode of 1e12 1/s is far above the band
}

TEST(GltfModalModel, MassFollowsFromTheSurfaceWhereItIsNotGiven) {
  GltfAudio audio = onePoint({440.0F}, {1.0F});
  GltfModalModel& model = audio.models[0];
  model.massProperties.reset();
  const auto refused = toModalModel(audio, 0, 1.0, *findMaterial("glass"));
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("has no massProperties, and no closed surface"));

  model.positions.clear();
  for (const Vec3& vertex : corner().vertices)
    model.positions.emplace_back(vertex.cast<float>());
  for (const auto& triangle : corner().triangles)
    model.indices.insert(model.indices.end(), triangle.begin(), triangle.end());
  model.shapes.assign(4, Eigen::Vector3f::Ones());
  const auto solid = toModalModel(audio, 0, 2.0, *findMaterial("glass"));
  ASSERT_TRUE(solid) << solid.error().message;
  // A corner with legs of 2 m has 8/6 m^3, and its centroid is a quarter of the way along each
  // axis.
  EXPECT_NEAR(solid->mass, 2700.0 * 8.0 / 6.0, 1e-9);
  EXPECT_TRUE(solid->centreOfMass.isApprox(Vec3(0.5, 0.5, 0.5)));
  EXPECT_EQ(solid->inertia, Eigen::Matrix3d::Zero());

  std::swap(model.indices[0], model.indices[1]);
  EXPECT_FALSE(toModalModel(audio, 0, 2.0, *findMaterial("glass")));
}

TEST(GltfModalModel, WhatTheMaterialDoesNotSayIsOfTheFallback) {
  GltfAudio audio = onePoint({440.0F}, {1.0F});
  EXPECT_EQ(toModalModel(audio, 0, 1.0, *findMaterial("red_oak"))->material.name, "red_oak");
  GltfAcousticMaterial& material = audio.materials.emplace_back();
  material.density = 1234.0;
  audio.models[0].material = 0;
  const auto model = toModalModel(audio, 0, 1.0, *findMaterial("red_oak"));
  ASSERT_TRUE(model);
  EXPECT_EQ(model->material.density, 1234.0);
  EXPECT_EQ(model->material.youngsModulus, findMaterial("red_oak")->youngsModulus);
  EXPECT_EQ(model->material.restitution, findMaterial("red_oak")->restitution);
}

// The draft allows a negative ratio, which is physical, but Material does not.
TEST(GltfModalModel, RefusesAMaterialThatSwellsWhenPulled) {
  GltfAudio audio = onePoint({440.0F}, {1.0F});
  audio.materials.emplace_back().poissonRatio = -0.3;
  audio.models[0].material = 0;
  const auto model = toModalModel(audio, 0, 1.0, *findMaterial("glass"));
  ASSERT_FALSE(model);
  EXPECT_THAT(model.error().message, HasSubstr("modal model 0 '': material"));
}

TEST(GltfModalModel, ScaleIsThatOfTheNodeIfItHasOne) {
  GltfAudioNode node;
  EXPECT_EQ(*uniformScale(node), 1.0);
  node.globalTransform.topLeftCorner<3, 3>() =
      0.25 * Eigen::AngleAxisd(1.0, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  ASSERT_TRUE(uniformScale(node));
  EXPECT_NEAR(*uniformScale(node), 0.25, 1e-15);
  node.globalTransform.col(0) *= 1.01;
  EXPECT_FALSE(uniformScale(node));
  node.globalTransform.setZero();
  EXPECT_FALSE(uniformScale(node));
}

TEST(GltfModalModel, AModelWithoutModesIsNoneOfTheDraft) {
  ModalModel silent = glassCorner();
  silent.modes.clear();
  silent.shapes.clear();
  GltfAudio audio;
  addModalModel(audio, silent);
  EXPECT_THAT(validate(audio).error().message,
              HasSubstr("/modalModels/0/frequencies: must be of one mode or more"));
}

TEST(GltfModalModel, TheBellIsAModel) {
  const auto audio =
      readGltfAudio(std::filesystem::path(CAROM_SOURCE_DIR) / "tests/modal/data/bell.gltf");
  ASSERT_TRUE(audio) << audio.error().message;
  const auto scale = uniformScale(audio->nodes[0]);
  ASSERT_TRUE(scale) << scale.error().message;
  const auto bell = toModalModel(*audio, 0, *scale, *findMaterial("bronze"));
  ASSERT_TRUE(bell) << bell.error().message;
  EXPECT_EQ(bell->mass, 12.5);
  EXPECT_TRUE(bell->centreOfMass.isApprox(Vec3(0.5, 0.5, 0.5)));
  EXPECT_EQ(bell->surface.vertices[1], Vec3(2, 0, 0));
  EXPECT_EQ(bell->shape(1, 3), Vec3(4, 5, 6));  // of 440 Hz, which is the first in the file
  // A quarter of a turn about z changes the first two moments.
  EXPECT_TRUE(bell->inertia.isApprox(Eigen::Matrix3d(Vec3(2, 1, 3).asDiagonal()), 1e-14));
}

}  // namespace
}  // namespace carom::test
