#include "scenes/run/plan.h"

#include <algorithm>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "scenes/run/native_only.h"
#include "scenes/run/scene_stepper.h"
#include "tests/scenes/library.h"
#include "tests/support/temporary_folder.h"

namespace carom::test {

using namespace scenes;

namespace {

const SceneBody kFloor = {"floor", *findMaterial("concrete"), PlaneShape{}};

SceneBody ballAt(double height) {
  return {"ball" + std::to_string(height), *findMaterial("steel"),
          SphereShape{.radius = 0.01, .mass = 0.03, .position = {0.0, height, 0.0}}};
}

Scene sceneOf(std::vector<SceneBody> bodies, StepperType stepper = StepperType::native) {
  Scene scene;
  scene.duration = 1.0;
  scene.bodies = std::move(bodies);
  scene.listeners = {{"listener", {0.0, 1.0, 1.0}}};
  scene.stepper.type = stepper;
  return scene;
}

std::set<std::string> needed(const Scene& scene) {
  const Plan plan = makePlan(scene);
  return {plan.needed.begin(), plan.needed.end()};
}

std::set<std::string> leftOut(const Scene& scene) {
  std::set<std::string> stages;
  for (const LeftOut& entry : makePlan(scene).leftOut)
    stages.insert(entry.stage);
  return stages;
}

using Stages = std::set<std::string>;

TEST(Plan, OneBallOverAFloorNeedsNoSphereContacts) {
  const Scene scene = sceneOf({kFloor, ballAt(1.0)});
  EXPECT_EQ(needed(scene), (Stages{"native_stepper", "gravity", "sphere_plane_contacts",
                                   "acceleration_noise", "radiation", "doppler"}));
  EXPECT_EQ(
      leftOut(scene),
      (Stages{"bullet_world", "bullet_bridge", "sphere_sphere_contacts",
              "acceleration_noise_of_planes", "forces", "sphere_block_contacts", "solid_contacts",
              "jello", "friction", "lasting_contacts", "modal_bank", "deforming_source",
              "moving_listeners", "images", "binaural", "late_reverberation"}));
}

TEST(Plan, TwoBallsInFreeFlightNeedNeitherPlanesNorGravity) {
  Scene scene = sceneOf({ballAt(0.0), ballAt(1.0)});
  scene.gravity.setZero();
  EXPECT_EQ(needed(scene), (Stages{"native_stepper", "sphere_sphere_contacts", "acceleration_noise",
                                   "radiation", "doppler"}));
  EXPECT_TRUE(leftOut(scene).contains("gravity"));
  EXPECT_TRUE(leftOut(scene).contains("sphere_plane_contacts"));
}

TEST(Plan, OneBallAloneNeedsNoContacts) {
  const Scene scene = sceneOf({ballAt(1.0)});
  EXPECT_EQ(needed(scene),
            (Stages{"native_stepper", "gravity", "acceleration_noise", "radiation", "doppler"}));
}

TEST(Plan, GravityInAnyDirectionCounts) {
  for (const Vec3& gravity : {Vec3(1e-9, 0.0, 0.0), Vec3(0.0, 0.0, -1.6), Vec3(0.0, 9.81, 0.0)}) {
    Scene scene = sceneOf({ballAt(1.0)});
    scene.gravity = gravity;
    EXPECT_TRUE(needed(scene).contains("gravity"));
  }
}

TEST(Plan, TheStepperDecidesBetweenNativeAndBulletWithItsBridge) {
  const Scene bullet = sceneOf({kFloor, ballAt(1.0), ballAt(2.0)}, StepperType::bullet);
  EXPECT_EQ(needed(bullet),
            (Stages{"bullet_world", "bullet_bridge", "gravity", "sphere_sphere_contacts",
                    "sphere_plane_contacts", "lasting_contacts", "acceleration_noise", "radiation",
                    "doppler"}));
  EXPECT_TRUE(leftOut(bullet).contains("native_stepper"));
  Scene smooth = bullet;
  for (SceneBody& body : smooth.bodies)
    body.material.roughness = {};
  EXPECT_TRUE(leftOut(smooth).contains("lasting_contacts"));
}

std::string whyLeftOut(const Scene& scene, std::string_view stage) {
  const Plan plan = makePlan(scene);
  const auto entry = std::ranges::find(plan.leftOut, stage, &LeftOut::stage);
  return entry == plan.leftOut.end() ? "(needed)" : entry->why;
}

TEST(Plan, ImagesAndReverberationNeedARoomAndSayWhatIsMissing) {
  Scene scene = sceneOf({ballAt(1.0)});
  EXPECT_EQ(whyLeftOut(scene, "images"), "there is no plane that could reflect");
  scene = sceneOf({kFloor, ballAt(1.0)});
  EXPECT_NE(whyLeftOut(scene, "images").find("no room"), std::string::npos);
  EXPECT_NE(whyLeftOut(scene, "late_reverberation").find("no room"), std::string::npos);
  scene.sound.room.reflectors = {Reflector{Vec3::UnitY(), 0.0, {}}};
  EXPECT_TRUE(needed(scene).contains("images"));
  EXPECT_NE(whyLeftOut(scene, "late_reverberation").find("no reverb"), std::string::npos);
  scene.sound.room.order = 0;
  EXPECT_NE(whyLeftOut(scene, "images").find("order is 0"), std::string::npos);
  scene.sound.reverb = ReverbSettings{.volume = 50.0, .surface = 90.0};
  EXPECT_TRUE(needed(scene).contains("late_reverberation"));
}

TEST(Plan, StagesOfTheSoundFollowItsSettingsAndTheListeners) {
  Scene scene = sceneOf({kFloor, ballAt(1.0)});
  scene.sound.comparison.radiation = Radiation::compact;
  scene.sound.doppler = false;
  EXPECT_TRUE(leftOut(scene).contains("radiation"));
  EXPECT_TRUE(leftOut(scene).contains("doppler"));
  scene.listeners[0].format = ListenerFormat::binaural;
  scene.paths = {{0, {ListenerPose{.time = 1.0}}}};
  EXPECT_TRUE(needed(scene).contains("binaural"));
  EXPECT_TRUE(needed(scene).contains("moving_listeners"));
}

TEST(Plan, ForcesBlocksAndFrictionAreNeededWhereTheSceneHasThem) {
  EXPECT_TRUE(needed(libraryScene("swinging_cradle")).contains("forces"));
  EXPECT_TRUE(needed(libraryScene("nine_ball_break")).contains("friction"));
  EXPECT_TRUE(needed(libraryScene("marble_steps")).contains("sphere_block_contacts"));
  const Scene solid = sceneOf({kFloor, {"brick", *findMaterial("wood"), SolidShape{}}});
  EXPECT_TRUE(needed(solid).contains("solid_contacts"));
  EXPECT_TRUE(leftOut(solid).contains("sphere_plane_contacts"));
  Scene scene = sceneOf({kFloor, ballAt(1.0)});
  scene.bodies[1].contact.friction = 0.5;  // the floor has no friction
  EXPECT_TRUE(leftOut(scene).contains("friction"));
  EXPECT_TRUE(needed(libraryScene("wood_blocks")).contains("friction"));  // of the materials
  EXPECT_TRUE(leftOut(libraryScene("two_balls")).contains("friction"));
  scene.mechanics.drag.rate = 1.0;
  EXPECT_TRUE(needed(scene).contains("forces"));
}

TEST(Plan, NamesEveryStageOnceAndSaysWhyOneIsLeftOut) {
  Stages first;
  for (const std::string_view name : kLibrary) {
    for (const StepperType type : {StepperType::native, StepperType::bullet}) {
      const Scene scene = onStepper(libraryScene(name), type);
      const Plan plan = makePlan(scene);
      Stages all = needed(scene);
      all.merge(leftOut(scene));
      EXPECT_EQ(all.size(), plan.needed.size() + plan.leftOut.size()) << name;
      if (first.empty()) first = all;
      EXPECT_EQ(all, first) << name;
      for (const LeftOut& entry : plan.leftOut)
        EXPECT_FALSE(entry.why.empty()) << entry.stage;
    }
  }
}

TEST(Plan, WhatIsLeftOutNeverHappensInARun) {
  for (const std::string_view name : kLibrary) {
    for (const StepperType type : {StepperType::native, StepperType::bullet}) {
      Scene scene = onStepper(libraryScene(name), type);
      if (type == StepperType::bullet && !validateForBullet(scene)) continue;
      scene.duration = std::min(scene.duration, 1.0);
      const auto events = sceneEvents(scene);
      ASSERT_TRUE(events);
      ASSERT_FALSE(events->empty()) << name;
      const auto isPlane = [&](BodyId id) {
        return std::holds_alternative<PlaneShape>(scene.bodies[id].shape);
      };
      const auto isBlock = [&](BodyId id) {
        return std::holds_alternative<BlockShape>(scene.bodies[id].shape);
      };
      const bool planes = std::ranges::any_of(*events, [&](const ImpulseEvent& event) {
        return isPlane(event.body) || isPlane(event.other);
      });
      const bool pairs = std::ranges::any_of(*events, [&](const ImpulseEvent& event) {
        return !isPlane(event.body) && !isPlane(event.other) && !isBlock(event.body) &&
               !isBlock(event.other);
      });
      const bool blocks = std::ranges::any_of(*events, [&](const ImpulseEvent& event) {
        return isBlock(event.body) || isBlock(event.other);
      });
      EXPECT_FALSE(blocks && leftOut(scene).contains("sphere_block_contacts")) << name;
      EXPECT_FALSE(planes && leftOut(scene).contains("sphere_plane_contacts")) << name;
      EXPECT_FALSE(pairs && leftOut(scene).contains("sphere_sphere_contacts")) << name;
    }
  }
}

TEST(Plan, TheBankOfModesIsNeededWhereABodyRings) {
  for (const std::string_view name : kRingingLibrary)
    EXPECT_TRUE(needed(libraryScene(name)).contains("modal_bank")) << name;
  for (const std::string_view name : kLibrary)
    EXPECT_TRUE(leftOut(libraryScene(name)).contains("modal_bank")) << name;
}

TEST(Plan, EveryStageIsDocumented) {
  const std::string page = contents(std::filesystem::path(CAROM_SOURCE_DIR) / "docs" / "scenes.md");
  const Scene scene = sceneOf({kFloor, ballAt(1.0)});
  Stages all = needed(scene);
  all.merge(leftOut(scene));
  all.insert({"inaudible_clicks", "jammed_spheres"});
  for (const std::string& stage : all)
    EXPECT_NE(page.find("| `" + stage + "` |"), std::string::npos) << stage;
}

}  // namespace
}  // namespace carom::test
