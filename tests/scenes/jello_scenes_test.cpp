// Scenes with a jello, from the file to the sound.

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "audio/io/byte_file.h"
#include "scenes/format/jello_reader.h"
#include "scenes/recording/recorded_scene.h"
#include "scenes/run/jello_modes.h"
#include "scenes/run/jello_scene.h"
#include "scenes/run/native_only.h"
#include "scenes/run/plan.h"
#include "scenes/run/render.h"
#include "tests/scenes/library.h"
#include "tests/support/temporary_folder.h"

namespace carom::test {

using namespace audio;
using namespace native;
using namespace scenes;

namespace {

using testing::Contains;
using testing::HasSubstr;

/// A jello of 27 points that turns freely, and a marble that hits it.
Scene wobble(const std::string& listeners = R"({"position": [0, 0, 0.7]})",
             const std::string& more = "") {
  return orAbort(parseScene(R"({
    "duration": 0.25, "gravity": [0, 0, 0],
    "bodies": [
      {"type": "jello", "name": "cube", "points": 3, "size": [0.2, 0.2, 0.2], "mass": 0.3,
       "stiffness": 300, "damping": 0.05, "position": [0, 0, 0], "spin": [0, 0, 2],
       "integrator": "rk4", "step": 0.0002},
      {"type": "sphere", "name": "marble", "radius": 0.02, "material": "glass",
       "position": [0.03, 0.2, 0.01], "velocity": [0, -2, 0]})" +
                                more + R"(],
    "listeners": [)" + listeners +
                                "]}",
                            "wobble.json"));
}

std::vector<std::vector<float>> soundOf(const Scene& scene) {
  Result<SceneSound> sound = SceneSound::create(scene);
  EXPECT_TRUE(sound);
  std::vector<std::vector<float>> whole(channelsOf(scene));
  std::vector<std::vector<float>> block(whole.size(), std::vector<float>(1000));
  while (const std::size_t frames = sound->render(block))
    for (std::size_t channel = 0; channel < whole.size(); ++channel)
      whole[channel].insert(whole[channel].end(), block[channel].begin(),
                            block[channel].begin() + static_cast<std::ptrdiff_t>(frames));
  return whole;
}

// The cubes of the world files are those of the scenes, except for rounding: the files have 9
// digits, the scenes a rotation. After the compared time, a cube on its edge may fall to either
// side.
TEST(JelloScenes, AWorldFileAndItsSceneMoveAlike) {
  for (const char* name : {"drop", "inclined_plane"}) {
    const auto bytes = readBytes(std::filesystem::path(CAROM_SOURCE_DIR) / "scenes" / "library" /
                                 "jello" / (std::string(name) + ".w"));
    ASSERT_TRUE(bytes);
    const auto file =
        jelloFromText({reinterpret_cast<const char*>(bytes->data()), bytes->size()}, name);
    ASSERT_TRUE(file);
    auto fromFile = JelloSceneStepper::create(sceneOf(*file, 1.0, Vec3::Zero()));
    auto fromScene = JelloSceneStepper::create(libraryScene(std::string("jello_") + name));
    ASSERT_TRUE(fromFile && fromScene);
    (*fromFile)->advanceTo(0.8);
    (*fromScene)->advanceTo(0.8);
    const JelloStepper& one = (*fromFile)->coupling().jello();
    const JelloStepper& two = (*fromScene)->coupling().jello();
    ASSERT_EQ(one.steps(), two.steps());
    for (std::size_t point = 0; point < 512; ++point) {
      EXPECT_LT((one.position(point) - two.position(point)).norm(), 1e-5) << name << point;
    }
    EXPECT_GT(one.energy().elastic, 1e-3) << name;
  }
}

TEST(JelloScenes, MarblesMeetTheJelloTheTableAndEachOther) {
  Scene scene = libraryScene("jello_and_marbles");
  scene.duration = 1.0;
  const auto events = sceneEvents(scene);
  ASSERT_TRUE(events);
  std::set<std::pair<std::string, std::string>> pairs;
  for (const ImpulseEvent& event : *events)
    pairs.insert({scene.bodies[event.body].name, scene.bodies[event.other].name});
  for (const char* marble : {"marble1", "marble2", "marble3"}) {
    EXPECT_THAT(pairs, Contains(std::pair<std::string, std::string>(marble, "cube")));
    EXPECT_THAT(pairs, Contains(std::pair<std::string, std::string>(marble, "table")));
  }
}

// The sound of a scene is that of its jello, which is sampled separately here, plus the clicks.
TEST(JelloScenes, TheJelloIsHeardAlongWithTheClicks) {
  const Scene scene = wobble();
  const std::vector<float> sound = soundOf(scene).front();
  ASSERT_EQ(sound.size(), 12000U);
  auto stepper = JelloSceneStepper::create(scene);
  ASSERT_TRUE(stepper);
  auto source = DeformingSource::create({.step = (*stepper)->hearDeformations()});
  ASSERT_TRUE(source);
  std::vector<ImpulseEvent> events;
  while ((*stepper)->coupling().time() < 0.5) {
    const auto known = (*stepper)->advanceTo((*stepper)->settledTime() + 1e-3);
    events.insert(events.end(), known.begin(), known.end());
    for (const DeformingState& state : (*stepper)->deformations())
      source->add(state);
  }
  ASSERT_EQ(events.size(), 2U);
  // Away from the marble's touch there is no click: the whole sound is the jello's.
  double loudest = 0.0;
  for (std::size_t frame = 0; frame < sound.size(); ++frame) {
    const double time = static_cast<double>(frame) / 48000.0;
    const double alone = source->at({0.0, 0.0, 0.7}, time).pressure;
    if (std::abs(time - events[0].time) < 0.05) continue;
    loudest = std::max(loudest, std::abs(alone));
    ASSERT_NEAR(sound[frame], alone, 1e-6 + 1e-5 * loudest) << time;
  }
  EXPECT_GT(loudest, 1e-3);
  // Around the touch there is more than the jello's sound.
  Scene quiet = scene;
  quiet.bodies.pop_back();
  const std::vector<float> without = soundOf(quiet).front();
  double click = 0.0;
  for (std::size_t frame = 0; frame < sound.size(); ++frame)
    click = std::max(click, std::abs(static_cast<double>(sound[frame]) - without[frame]));
  EXPECT_GT(click, 1e-4);
}

TEST(JelloScenes, APairOfMicrophonesHearsWhatTwoHear) {
  const auto pair = soundOf(wobble(
      R"({"format": "spaced_pair", "spacing": 0.4, "pattern": 0, "position": [0, 0, 0.7]})"));
  const auto two = soundOf(wobble(R"({"position": [-0.2, 0, 0.7]}, {"position": [0.2, 0, 0.7]})"));
  ASSERT_EQ(pair.size(), 2U);
  for (std::size_t channel = 0; channel < 2; ++channel)
    for (std::size_t frame = 0; frame < pair[channel].size(); ++frame)
      ASSERT_NEAR(pair[channel][frame], two[channel][frame], 1e-6);
}

TEST(JelloScenes, ABodyThatCannotBeBesideItIsRefused) {
  const Scene block = wobble(R"({"position": [0, 0, 0.7]})",
                             R"(, {"type": "block", "name": "step", "min": [4, 4, 4],
                                   "max": [5, 5, 5], "material": "wood"})");
  EXPECT_THAT(validateJello(block).error().message,
              HasSubstr("\"step\": a block cannot be beside a jello"));
  EXPECT_FALSE(makeStepper(block));
  const Scene lift = wobble(R"({"position": [0, 0, 0.7]})",
                            R"(, {"type": "plane", "name": "lift", "normal": [0, 1, 0],
                                  "offset": -3, "velocity": [0, 1, 0], "material": "wood"})");
  EXPECT_THAT(validateJello(lift).error().message, HasSubstr("\"lift\": a plane that moves"));
  EXPECT_THAT(validateForBullet(wobble()).error().message, HasSubstr("a jello"));
  EXPECT_THAT(validateForRecording(wobble()).error().message, HasSubstr("has a jello"));
  EXPECT_FALSE(nativeStepper(wobble()));
  EXPECT_TRUE(validateJello(wobble()));
}

TEST(JelloScenes, ABlowUpIsAnErrorOfARenderAndLeavesNoFile) {
  const TemporaryFolder folder;
  Scene scene = wobble();
  for (SceneBody& body : scene.bodies) {
    auto* jello = std::get_if<std::shared_ptr<const JelloShape>>(&body.shape);
    if (jello == nullptr) continue;
    JelloShape wild = **jello;
    wild.step = 0.05;
    wild.velocities.front() = {3.0, 0.0, 0.0};
    *jello = std::make_shared<const JelloShape>(wild);
  }
  EXPECT_THAT(instabilityWarning(scene), HasSubstr("the step is 50 ms: it may blow up"));
  EXPECT_EQ(instabilityWarning(wobble()), "");
  const auto report = renderScene(scene, {.soundFile = folder / "wild.wav"});
  ASSERT_FALSE(report);
  EXPECT_THAT(report.error().message, HasSubstr("blew up at"));
  EXPECT_FALSE(std::filesystem::exists(folder / "wild.wav"));
  EXPECT_FALSE(sceneEvents(scene));
}

TEST(JelloScenes, ThePlanHasItOnlyWhereItIs) {
  EXPECT_THAT(makePlan(wobble()).needed, Contains("jello"));
  EXPECT_THAT(makePlan(wobble()).needed, Contains("deforming_source"));
  EXPECT_THAT(makePlan(libraryScene("two_balls")).needed, testing::Not(Contains("jello")));
}

// Modulus of springs of 1 N/m, one metre apart, by hand: C11 = 1 of the springs along + 4 of bend +
// 4/2 of the diagonals of faces + 4/3 of those of cubes, and E = 5/6 C11 at a Poisson's ratio of
// 1/4.
TEST(JelloScenes, AJellosModulusIsThatOfItsSprings) {
  const JelloLattice lattice{
      .count = 5, .size = Vec3::Constant(4.0), .pointMass = 2.0, .stiffness = 6.0};
  const Material material = jelloMaterial(lattice);
  EXPECT_NEAR(material.youngsModulus, 6.0 * 5.0 / 6.0 * (1.0 + 4.0 + 2.0 + 4.0 / 3.0), 1e-9);
  EXPECT_NEAR(material.density, 2.0 * 125.0 / 64.0, 1e-12);
}

// After a weak strike at a corner, the sum of the modes' oscillations and of the rigid motion
// equals the motion that the springs cause.
TEST(JelloModes, AWeakStrikeMovesItAsItsModesSay) {
  JelloWorld world;
  world.lattice = {.count = 3,
                   .size = {0.06, 0.05, 0.07},
                   .pointMass = 0.002,
                   .stiffness = 3000.0,
                   .damping = 0.02};
  world.positions = restingPoints(world.lattice, Vec3::Zero());
  world.velocities.assign(world.pointCount(), Vec3::Zero());
  const Vec3 impulse(2e-8, -1e-8, 1.5e-8);  // N s, at the first point
  world.velocities.front() = impulse / world.lattice.pointMass;
  const Result<ModalModel> model = jelloModalModel(world.lattice, {.modes = 200});
  ASSERT_TRUE(model);
  ASSERT_EQ(model->modes.size() + model->leftOut.rigid, 81U);
  ASSERT_EQ(model->surface.vertices.front(), world.positions.front());
  JelloStepper stepper = *JelloStepper::create(world, JelloIntegrator::rungeKutta4, 2e-6);
  double farthest = 0.0;
  double moved = 0.0;
  for (int step = 1; step <= 20000; ++step) {
    ASSERT_TRUE(stepper.advance());
    if (step % 100 != 0) continue;
    const double time = stepper.time();
    const Vec3 at = world.positions.front();
    Vec3 place = impulse / model->mass * time -
                 at.cross(model->inertia.inverse() * at.cross(impulse)) * time;
    for (std::size_t mode = 0; mode < model->modes.size(); ++mode) {
      const double sigma = model->modes[mode].decayRate;
      const double omega = 2.0 * std::numbers::pi * model->modes[mode].frequency;
      const double damped = std::sqrt(omega * omega - sigma * sigma);
      const Vec3 shape = model->shape(mode, 0);
      place +=
          shape * (shape.dot(impulse) * std::exp(-sigma * time) * std::sin(damped * time) / damped);
    }
    farthest = std::max(farthest, (stepper.position(0) - at - place).norm());
    moved = std::max(moved, place.norm());
  }
  EXPECT_LT(farthest, 1e-4 * moved);
}

TEST(JelloModes, WhatHasNoneIsRefused) {
  JelloLattice lattice;
  EXPECT_FALSE(jelloModalModel(lattice));
  lattice.stiffness = 100.0;
  EXPECT_FALSE(jelloModalModel(lattice, {.modes = 0}));
  lattice.size.x() = 0.0;
  EXPECT_FALSE(jelloModalModel(lattice));
}

}  // namespace
}  // namespace carom::test
