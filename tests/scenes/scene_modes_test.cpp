#include "scenes/run/scene_modes.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "carom/audio/modal_model_file.h"
#include "carom/modal/gltf_audio.h"
#include "scenes/recording/event_tape.h"
#include "scenes/recording/recorded_scene.h"
#include "scenes/run/scene_sound.h"
#include "scenes/run/scene_stepper.h"
#include "tests/scenes/library.h"
#include "tests/support/temporary_folder.h"

namespace carom::test {

using namespace scenes;

namespace {

const std::string kCoarse = R"({"dofs": 600, "count": 4, "panels": 200})";

/// Steel bars, 20 x 2 x 1 cm, that fall onto a floor of concrete.
Scene fallingBars(const std::vector<std::string>& modes) {
  std::string bodies =
      R"({"type": "plane", "normal": [0, 1, 0], "offset": 0, "material": "concrete"})";
  for (std::size_t bar = 0; bar < modes.size(); ++bar)
    bodies += R"(, {"type": "solid", "shape": {"type": "box", "half_extents": [0.1, 0.01, 0.005]},
                   "material": "carbon_steel", "rotation": {"axis": [0, 0, 1], "angle": 20},
                   "position": [0, 0.1, )" +
              std::to_string(bar) + "]" + (modes[bar].empty() ? "" : ", \"modes\": " + modes[bar]) +
              "}";
  Scene scene =
      orAbort(parseScene(R"({"duration": 0.5, "stepper": {"type": "bullet", "step": 0.001},
      "listeners": [{"position": [0, 0.5, 0.5]}], "bodies": [)" +
                             bodies + "]}",
                         "bars.json"));
  scene.recoil = RecoilModel::sphere;  // their click takes seconds to solve by its shape
  return scene;
}

/// A scene's first channel, rendered in blocks of `frames`.
std::vector<float> samplesOf(Result<SceneSound> sound, std::size_t frames = 1024) {
  EXPECT_TRUE(sound) << sound.error().message;
  std::vector<float> all;
  std::vector<std::vector<float>> block(1, std::vector<float>(frames));
  while (const std::size_t count = sound->render(block))
    all.insert(all.end(), block[0].begin(), block[0].begin() + static_cast<std::ptrdiff_t>(count));
  return all;
}

/// Energy of the sound from a share of its duration on: the sum of squares in Pa^2.
double energyFrom(double share, const std::vector<float>& all) {
  double sum = 0.0;
  const auto begin = static_cast<std::size_t>(share * static_cast<double>(all.size()));
  for (std::size_t sample = begin; sample < all.size(); ++sample)
    sum += static_cast<double>(all[sample]) * static_cast<double>(all[sample]);
  return sum;
}

/// Energy of the sound's second half, when all bounces are over.
double tailOf(const Scene& scene) {
  return energyFrom(0.5, samplesOf(SceneSound::create(scene)));
}

/// A steel ball that flies past the listener, from one wall to another.
constexpr std::string_view kFlyingBall = R"({"duration": 0.6, "gravity": [0, 0, 0],
    "listeners": [{"position": [0, 1, 0]}],
    "bodies": [{"type": "plane", "normal": [1, 0, 0], "offset": -1.5, "material": "concrete"},
               {"type": "plane", "normal": [-1, 0, 0], "offset": -2, "material": "concrete"},
               {"type": "sphere", "radius": 0.2, "material": "carbon_steel",
                "position": [-1.2, 0, 0], "velocity": [-9, 0, 0.5],
                "modes": {"dofs": 600, "count": 4, "panels": 120}}]})";

/// Computed models are cached in a folder of the test's own.
class SceneModes : public testing::Test {
 protected:
  SceneModes() { setenv("XDG_CACHE_HOME", folder_.path().c_str(), 1); }
  ~SceneModes() override { unsetenv("XDG_CACHE_HOME"); }

  const TemporaryFolder folder_;
};

TEST_F(SceneModes, BodiesOfOneShapeAndMaterialShareOneModel) {
  Scene scene = fallingBars({kCoarse, kCoarse, "", kCoarse});
  scene.bodies.back().material = *findMaterial("brass");
  const auto modes = sceneModes(scene);
  ASSERT_TRUE(modes) << modes.error().message;
  ASSERT_EQ(modes->size(), 5U);
  EXPECT_EQ((*modes)[0].model, nullptr);  // the floor
  ASSERT_NE((*modes)[1].model, nullptr);
  EXPECT_EQ((*modes)[1].model, (*modes)[2].model);
  EXPECT_EQ((*modes)[3].model, nullptr);
  ASSERT_NE((*modes)[4].model, nullptr);
  EXPECT_NE((*modes)[4].model, (*modes)[1].model);
  EXPECT_EQ((*modes)[4].model->material.name, "brass");
  EXPECT_EQ((*modes)[1].model->modes.size(), 4U);
}

TEST_F(SceneModes, BodiesThatNameOneFileShareOneModelInTheFrameOfTheirShape) {
  const auto computed = sceneModes(fallingBars({kCoarse}));
  ASSERT_TRUE(computed);
  const std::filesystem::path file = folder_ / "bar.carom_modes";
  ASSERT_TRUE(writeModalModel(file, *(*computed)[1].model));
  const std::string name = '"' + file.string() + '"';
  Scene scene = fallingBars({name, name});
  std::get<SolidShape>(scene.bodies[1].shape).centreOfMass = Vec3(0.01, 0.02, 0.03);
  const auto modes = sceneModes(scene);
  ASSERT_TRUE(modes) << modes.error().message;
  ASSERT_NE((*modes)[1].model, nullptr);
  EXPECT_EQ((*modes)[1].model, (*modes)[2].model);
  EXPECT_EQ((*modes)[1].origin, Vec3(0.01, 0.02, 0.03));
  EXPECT_EQ((*modes)[2].origin, Vec3::Zero());
}

/// Returns the model as another program would write it: without a word on how its modes radiate.
GltfAudio foreign(const std::vector<const ModalModel*>& models) {
  GltfAudio audio;
  for (const ModalModel* model : models) {
    addModalModel(audio, *model);
    audio.models.back().volumes.clear();
    audio.nodes.back().name = "bar " + std::to_string(audio.nodes.size());
  }
  return audio;
}

TEST_F(SceneModes, AModelThatDoesNotSayHowItRadiatesIsHeardLikeOneThatDoes) {
  const auto computed = sceneModes(fallingBars({R"({"dofs": 600, "count": 4})"}));
  ASSERT_TRUE(computed);
  const ModalModel& own = *(*computed)[1].model;
  const std::filesystem::path file = folder_ / "bar.glb";
  ASSERT_TRUE(writeGltfAudio(file, foreign({&own})));
  const auto modes = sceneModes(fallingBars({'"' + file.string() + '"'}));
  ASSERT_TRUE(modes) << modes.error().message;
  const ModalModel& read = *(*modes)[1].model;
  ASSERT_EQ(read.modes.size(), own.modes.size());
  for (std::size_t mode = 0; mode < own.modes.size(); ++mode) {
    const auto& wanted = own.modes[mode].radiation.multipoles;
    const auto& found = read.modes[mode].radiation.multipoles;
    ASSERT_EQ(found.size(), wanted.size()) << mode;
    double error = 0.0;
    double power = 0.0;
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      error += std::norm(found[i] - wanted[i]);
      power += std::norm(wanted[i]);
    }
    // A mesh in floats is clustered into other panels, of which each set is right to a per cent.
    EXPECT_LT(error, 1e-4 * power) << mode;
    EXPECT_NEAR(read.modes[mode].decayRate, own.modes[mode].decayRate,
                1e-6 * own.modes[mode].decayRate);
    EXPECT_NEAR(read.modes[mode].radiation.decayRate, own.modes[mode].radiation.decayRate,
                1e-2 * own.modes[mode].radiation.decayRate);
  }
}

TEST_F(SceneModes, ANodeSaysWhichModelOfAFileItIs) {
  Scene scene = fallingBars({kCoarse, kCoarse});
  scene.bodies.back().material = *findMaterial("brass");
  const auto computed = sceneModes(scene);
  ASSERT_TRUE(computed);
  const std::filesystem::path file = folder_ / "bars.gltf";
  GltfAudio both = foreign({(*computed)[1].model.get(), (*computed)[2].model.get()});
  both.nodes.back().globalTransform.topLeftCorner<3, 3>() *= 2.0;
  ASSERT_TRUE(writeGltfAudio(file, both));
  const std::string name = "\"file\": \"" + file.string() + "\"";
  const auto modes = sceneModes(
      fallingBars({"{" + name + R"(, "node": "bar 1"})", "{" + name + R"(, "node": "bar 2"})"}));
  ASSERT_TRUE(modes) << modes.error().message;
  EXPECT_EQ((*modes)[1].model->material.name, "carbon_steel");
  EXPECT_EQ((*modes)[2].model->material.name, "brass");
  const double once = (*modes)[1].model->surface.vertices.front().norm();
  EXPECT_NEAR((*modes)[2].model->surface.vertices.front().norm(), 2.0 * once, 1e-6 * once);

  for (const auto& [wrong, says] : {std::pair{"{" + name + "}", "\"bar 1\", \"bar 2\""},
                                    std::pair{"{" + name + R"(, "node": "bar"})",
                                              "no node that has a modal model is called"}}) {
    const auto refused = sceneModes(fallingBars({wrong}));
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find(says), std::string::npos) << refused.error().message;
  }
}

TEST_F(SceneModes, AModelThatWouldNotBeHeardIsRefused) {
  const auto computed = sceneModes(fallingBars({kCoarse}));
  ASSERT_TRUE(computed);
  GltfAudio points = foreign({(*computed)[1].model.get()});
  points.models.back().indices.clear();
  const std::filesystem::path file = folder_ / "points.glb";
  ASSERT_TRUE(writeGltfAudio(file, points));
  const auto refused = sceneModes(fallingBars({'"' + file.string() + '"'}));
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("would not be heard"), std::string::npos);
  ASSERT_TRUE(writeGltfAudio(file, GltfAudio{}));
  const auto none = sceneModes(fallingBars({'"' + file.string() + '"'}));
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("no modal model"), std::string::npos);
}

TEST_F(SceneModes, TheSecondTimeTheyComeFromTheCache) {
  const auto stages = [&] {
    int told = 0;
    EXPECT_TRUE(sceneModes(fallingBars({kCoarse}), [&](std::string_view, double) {
      ++told;
      return true;
    }));
    return told;
  };
  EXPECT_GT(stages(), 0);
  EXPECT_EQ(stages(), 0);
}

TEST_F(SceneModes, ABodyWhoseModesAllLieAboveHearingIsSilentAndNoError) {
  const Scene scene = orAbort(parseScene(R"({"duration": 1, "stepper": {"type": "bullet"},
    "listeners": [{"position": [0, 1, 1]}],
    "bodies": [{"type": "solid", "shape": {"type": "box", "half_extents": [0.005, 0.005, 0.005]},
                "material": "carbon_steel", "position": [0, 1, 0],
                "modes": {"dofs": 600, "panels": 200}}]})",
                                         "die.json"));
  const auto modes = sceneModes(scene);
  ASSERT_TRUE(modes) << modes.error().message;
  EXPECT_EQ((*modes)[0].model, nullptr);
  EXPECT_TRUE(SceneSound::create(scene));
}

// The lowest mode of a solid sphere is torsional, at k a = 2.5011 for shear waves (Lamb 1882); the
// lowest spheroidal one is at 2.64 for a Poisson's ratio of 0.3.
TEST_F(SceneModes, ASphereRingsAsLambSays) {
  Scene scene = orAbort(parseScene(R"({"duration": 1, "listeners": [{"position": [0, 1, 1]}],
    "bodies": [{"type": "sphere", "radius": 0.2, "material": "carbon_steel", "position": [0, 1, 0],
                "modes": {"dofs": 3000, "count": 10, "panels": 120}}]})",
                                   "sphere.json"));
  const auto modes = sceneModes(scene);
  ASSERT_TRUE(modes) << modes.error().message;
  ASSERT_NE((*modes)[0].model, nullptr);
  const ModalModel& model = *(*modes)[0].model;
  const Material& steel = scene.bodies[0].material;
  const double shear =
      std::sqrt(steel.youngsModulus / (2.0 * (1.0 + steel.poissonsRatio)) / steel.density);
  const double unit = shear / (2.0 * std::numbers::pi * 0.2);
  ASSERT_EQ(model.modes.size(), 10U);
  for (std::size_t mode = 0; mode < 5; ++mode)
    EXPECT_NEAR(model.modes[mode].frequency, 2.5011 * unit, 0.03 * 2.5011 * unit) << mode;
  for (std::size_t mode = 5; mode < 10; ++mode)
    EXPECT_NEAR(model.modes[mode].frequency, 2.64 * unit, 0.03 * 2.64 * unit) << mode;
  EXPECT_LT(model.centreOfMass.norm(), 1e-3);
}

// A mass that is given is spread over the volume: four times as much rings an octave lower.
TEST_F(SceneModes, ABodyRingsByTheMassThatItIsGiven) {
  const auto lowestOf = [](const std::string& mass) {
    const Scene scene = orAbort(parseScene(
        R"({"duration": 1, "listeners": [{"position": [0, 1, 1]}], "bodies": [{"type": "sphere",
        "radius": 0.2, )" +
            mass +
            R"("material": "carbon_steel", "position": [0, 1, 0],
        "modes": {"dofs": 600, "count": 4, "panels": 120}}]})",
        "sphere.json"));
    const auto modes = sceneModes(scene);
    EXPECT_TRUE(modes) << modes.error().message;
    return (*modes)[0].model->modes[0].frequency;
  };
  const double natural = 7850.0 * 4.0 / 3.0 * std::numbers::pi * 0.008;
  const double own = lowestOf("");
  EXPECT_NEAR(lowestOf("\"mass\": " + std::to_string(4.0 * natural) + ", "), 0.5 * own, 1e-4 * own);
  EXPECT_NEAR(lowestOf("\"mass\": " + std::to_string(natural) + ", "), own, 1e-4 * own);
}

TEST_F(SceneModes, WhatRingsIsHeardLongerThanWhatDoesNot) {
  const double dry = tailOf(fallingBars({""}));
  const double ringing = tailOf(fallingBars({kCoarse}));
  EXPECT_GT(ringing, 10.0 * dry);
}

// The poses are those that the events have, in the same frame of the body.
TEST_F(SceneModes, PosesOfWhatRingsAgreeWithItsEvents) {
  const Scene bars = fallingBars({kCoarse, ""});
  for (const Scene& scene : {bars, orAbort(parseScene(kFlyingBall, "ball.json"))}) {
    const BodyId ringing = movingRings(scene).at(0);
    ASSERT_EQ(movingRings(scene).size(), 1U);
    auto stepper = makeStepper(scene);
    ASSERT_TRUE(stepper);
    std::vector<ImpulseEvent> events;
    std::vector<BodyPose> poses;
    for (double time = 0.05; time < 0.5; time += 0.05) {
      const auto more = (*stepper)->advanceTo(time);
      events.insert(events.end(), more.begin(), more.end());
      poses.insert(poses.end(), (*stepper)->poses().begin(), (*stepper)->poses().end());
    }
    EXPECT_EQ(poses.front().pose.time, 0.0);
    int compared = 0;
    for (const ImpulseEvent& event : events) {
      if (event.body != ringing) continue;
      const auto after = std::ranges::lower_bound(
          poses, event.time, {}, [](const BodyPose& pose) { return pose.pose.time; });
      if (after == poses.begin() || after == poses.end()) continue;
      const ListenerPose& last = std::prev(after)->pose;
      EXPECT_EQ(after->body, ringing);
      const double since = event.time - last.time;
      EXPECT_LE(since, kPoseStep * 1.001);
      EXPECT_LT((last.position - event.bodyPosition).norm(),
                1e-4 + since * 1.5 * event.bodyVelocity.norm());
      EXPECT_LT(last.orientation.angularDistance(event.bodyOrientation),
                1e-3 + since * 1.5 * event.bodyAngularVelocity.norm());
      ++compared;
    }
    EXPECT_GT(compared, 0);
  }
}

TEST_F(SceneModes, AListenerWhoWalksAwayHearsARingFainter) {
  Scene scene = fallingBars({kCoarse});
  const Vec3 from(0.0, 0.6, 0.8);  // a level ear would be at the node of how the bar bends
  scene.listeners[0].position = from;
  const std::vector<float> standing = samplesOf(SceneSound::create(scene));
  // The bar has come down by 0.3 s; then the listener leaves.
  ListenerPath path;
  path.poses = {{0.3, from, Quat::Identity()}, {0.45, 8.0 * from, Quat::Identity()}};
  scene.paths = {path};
  const std::vector<float> walking = samplesOf(SceneSound::create(scene));
  const double level = 10.0 * std::log10(energyFrom(0.96, walking) / energyFrom(0.96, standing));
  EXPECT_NEAR(level, -20.0 * std::log10(8.0), 1.5);
}

// Neither the blocks nor a replay, which steps otherwise, can be heard while bodies ring and move.
TEST_F(SceneModes, BitsOfRingsInMotionDoNotDependOnHowTheyAreRendered) {
  const Scene bars = fallingBars({kCoarse, kCoarse});
  const std::vector<float> wanted = samplesOf(SceneSound::create(bars));
  EXPECT_EQ(samplesOf(SceneSound::create(bars), 333), wanted);
  EXPECT_EQ(samplesOf(SceneSound::create(bars), 9999), wanted);
  auto stepper = makeStepper(bars);
  ASSERT_TRUE(stepper);
  const Result<EventTape> tape = recordTape(**stepper, bars.duration);
  ASSERT_TRUE(tape);
  const auto shared = std::make_shared<const EventTape>(*tape);
  EXPECT_EQ(samplesOf(SceneSound::create(bars, tapeStepper(shared), {})), wanted);

  const Scene ball = orAbort(parseScene(kFlyingBall, "ball.json"));
  const std::vector<float> flying = samplesOf(SceneSound::create(ball));
  EXPECT_GT(energyFrom(0.5, flying), 0.0);
  EXPECT_EQ(samplesOf(SceneSound::create(ball), 77), flying);
  const Result<carom::Recording> run = recordScene(ball, kFlyingBall, "ball.json");
  ASSERT_TRUE(run) << run.error().message;
  EXPECT_EQ(samplesOf(SceneSound::create(ball, replayStepper(*run, ball, 0.0), {})), flying);
}

TEST_F(SceneModes, ErrorsNameTheBody) {
  const auto absent = sceneModes(fallingBars({"\"absent.carom_modes\""}));
  ASSERT_FALSE(absent);
  EXPECT_EQ(absent.error().message.find("solid1: "), 0U) << absent.error().message;
  EXPECT_NE(absent.error().message.find("absent.carom_modes"), std::string::npos);
  std::ofstream(folder_ / "text.carom_modes") << "no model";
  const auto text = sceneModes(fallingBars({'"' + (folder_ / "text.carom_modes").string() + '"'}));
  ASSERT_FALSE(text);
  EXPECT_EQ(text.error().message.find("solid1: "), 0U) << text.error().message;
  const auto thick = sceneModes(fallingBars({R"({"body": "shell", "thickness": 900})"}));
  ASSERT_FALSE(thick);
  EXPECT_EQ(thick.error().message.find("solid1: modes: "), 0U) << thick.error().message;
}

TEST_F(SceneModes, CanBeCutToTheLowest) {
  Scene scene = fallingBars({kCoarse, kCoarse});
  const auto all = sceneModes(scene);
  ASSERT_TRUE(all) << all.error().message;
  const ModalModel& whole = *(*all)[1].model;
  ASSERT_GT(whole.modes.size(), 2U);
  scene.mostModes = 2;
  const auto cut = sceneModes(scene);
  ASSERT_TRUE(cut) << cut.error().message;
  const ModalModel& lowest = *(*cut)[1].model;
  EXPECT_EQ((*cut)[1].model, (*cut)[2].model);
  ASSERT_EQ(lowest.modes.size(), 2U);
  for (std::size_t mode = 0; mode < 2; ++mode) {
    EXPECT_EQ(lowest.modes[mode].frequency, whole.modes[mode].frequency);
    for (std::size_t vertex = 0; vertex < whole.surface.vertices.size(); ++vertex)
      EXPECT_EQ(lowest.shape(mode, vertex), whole.shape(mode, vertex));
  }
  scene.mostModes = whole.modes.size();
  EXPECT_EQ((*sceneModes(scene))[1].model->modes.size(), whole.modes.size());
  scene.mostModes = 0;
  EXPECT_EQ((*sceneModes(scene))[1].model, nullptr);
}

TEST_F(SceneModes, CanBeStopped) {
  const auto stopped =
      sceneModes(fallingBars({kCoarse}), [](std::string_view, double) { return false; });
  ASSERT_FALSE(stopped);
  EXPECT_NE(stopped.error().message.find(kCancelled), std::string::npos);
}

TEST(SceneModesOfTheLibrary, AreAskedForByEveryRingingScene) {
  for (const std::string_view name : kRingingLibrary) {
    const Scene scene = libraryScene(name);
    EXPECT_TRUE(std::ranges::any_of(scene.bodies, [](const SceneBody& body) {
      return body.ringing.has_value();
    })) << name;
    EXPECT_EQ(scene.stepper.type, StepperType::bullet) << name;
  }
}

}  // namespace
}  // namespace carom::test
