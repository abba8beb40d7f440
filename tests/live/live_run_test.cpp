#include "scenes/live/live_run.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "audio/run/run_player.h"
#include "carom/audio/material.h"
#include "scenes/format/scene_loader.h"

namespace carom::scenes {

using namespace audio;

namespace {

Scene libraryScene(const std::string& name) {
  const auto file = std::filesystem::path(CAROM_SOURCE_DIR) / "scenes/library" / (name + ".json");
  Result<Scene> scene = loadScene(file);
  EXPECT_TRUE(scene) << scene.error().message;
  return *std::move(scene);
}

/// Two marbles above a floor, one of them beside where the other lands.
Scene marbles(StepperType stepper = StepperType::native) {
  const std::string text = R"({"duration": 2, "sample_rate": 48000,
    "bodies": [{"type": "plane", "normal": [0, 1, 0], "offset": 0, "material": "concrete"},
               {"type": "sphere", "radius": 0.01, "material": "glass", "position": [0, 0.3, 0]},
               {"type": "sphere", "radius": 0.012, "material": "steel", "position": [0.012, 0.9, 0]}],
    "listeners": [{"position": [0.3, 0.4, 0.5]}]})";
  Result<Scene> scene = parseScene(text, "marbles.json");
  EXPECT_TRUE(scene) << scene.error().message;
  scene->stepper.type = stepper;
  scene->stepper.step = 1.0 / 500.0;
  return *std::move(scene);
}

LiveRun begun(Scene scene) {
  Result<LiveRun> live = LiveRun::create(std::move(scene));
  EXPECT_TRUE(live) << live.error().message;
  return *std::move(live);
}

std::vector<ImpulseEvent> eventsOf(const LiveRun& live, double until) {
  std::vector<ImpulseEvent> events;
  for (const EventPlace& place : eventsInOrder(live.run())) {
    const ImpulseEvent& event = live.run().portions[place.portion].events[place.event];
    if (event.time <= until) events.push_back(event);
  }
  return events;
}

SceneBody ball(const Vec3& position, const Vec3& velocity, double radius = 0.01) {
  SceneBody body;
  body.name = "thrown";
  body.material = *std::ranges::find(builtInMaterials(), "rubber", &Material::name);
  SphereShape sphere;
  sphere.radius = radius;
  sphere.mass = 0.01;
  sphere.position = position;
  sphere.velocity = velocity;
  body.shape = sphere;
  return body;
}

SphereShape sphereAt(const LiveRun& live, BodyId body) {
  const Scene scene = live.now();
  return std::get<SphereShape>(scene.bodies[body].shape);
}

class LiveLibrary : public testing::TestWithParam<const char*> {};

TEST_P(LiveLibrary, GoesOnAsTheSceneDoes) {
  Scene scene = libraryScene(GetParam());
  scene.duration = std::min(scene.duration, 0.8);
  const Result<std::vector<ImpulseEvent>> wanted = sceneEvents(scene);
  ASSERT_TRUE(wanted);
  ASSERT_FALSE(wanted->empty());
  LiveRun live = begun(scene);
  for (double time = 0.013; time < scene.duration; time += 0.041)
    ASSERT_TRUE(live.advanceTo(time));
  ASSERT_TRUE(live.advanceTo(scene.duration + 0.05));
  const std::vector<ImpulseEvent> had = eventsOf(live, scene.duration);
  ASSERT_EQ(had.size(), wanted->size());
  for (std::size_t index = 0; index < had.size(); ++index) {
    EXPECT_EQ(had[index].time, (*wanted)[index].time);
    EXPECT_EQ(had[index].body, (*wanted)[index].body);
    EXPECT_EQ((had[index].impulse - (*wanted)[index].impulse).norm(), 0.0);
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, LiveLibrary,
                         testing::Values("two_balls", "newtons_cradle", "marbles_in_a_box",
                                         "billiard_break", "wood_blocks", "box_slides_to_rest"),
                         [](const auto& one) { return std::string(one.param); });

TEST(LiveRuns, SoundWhileTheyGoOnAsTheyDoLater) {
  LiveRun live = begun(marbles());
  PlayableRun empty = live.run();
  empty.portions.clear();
  const Result<std::vector<std::byte>> bytes = encodedRun(empty);
  ASSERT_TRUE(bytes);
  Result<PlayableRun> opened = decodedRun(*bytes);
  ASSERT_TRUE(opened) << opened.error().message;
  Result<RunPlayer> player = RunPlayer::create(*std::move(opened), 48000.0);
  ASSERT_TRUE(player);
  player->setOpen(true);
  player->follow(0);
  ASSERT_TRUE(player->seek({}));
  constexpr std::size_t kFrames = 48000;
  constexpr std::size_t kBlock = 480;
  std::vector<float> grown(kFrames);
  std::size_t sent = 0;
  for (std::size_t done = 0; done < kFrames; done += kBlock) {
    const double ahead = static_cast<double>(done + kBlock) / 48000.0 + RunPlayer::kLookahead;
    ASSERT_TRUE(live.advanceTo(ahead));
    RunMore more;
    for (; sent < live.run().portions.size(); ++sent)
      more.portions.push_back(live.run().portions[sent]);
    const Result<RunMore> received = decodedMore(*encodedMore(more), live.run().world.bodies);
    ASSERT_TRUE(received) << received.error().message;
    ASSERT_TRUE(player->append(*received));
    float* const at = grown.data() + done;
    player->render(std::span(&at, 1), kBlock);
  }
  EXPECT_EQ(player->late(), 0u);
  Result<RunPlayer> later = RunPlayer::create(live.run(), 48000.0);
  ASSERT_TRUE(later);
  later->follow(0);
  ASSERT_TRUE(later->seek({}));
  std::vector<float> whole(kFrames);
  float* const at = whole.data();
  later->render(std::span(&at, 1), kFrames);
  EXPECT_EQ(grown, whole);
  EXPECT_GT(*std::ranges::max_element(whole), 0.01F);
}

TEST(LiveRuns, AreTakenBackAndGoOnAsBefore) {
  LiveRun live = begun(marbles());
  ASSERT_TRUE(live.advanceTo(1.0));
  const std::vector<ImpulseEvent> before = eventsOf(live, 1.0);
  ASSERT_GE(before.size(), 8u);
  ASSERT_TRUE(live.rewind(0.4));
  EXPECT_LE(live.time(), 0.4);
  EXPECT_GT(live.time(), 0.4 - 2.0 * LiveRun::kFrame);
  EXPECT_LE(live.run().portions.back().settledTime, 0.4);
  ASSERT_TRUE(live.advanceTo(1.0));
  const std::vector<ImpulseEvent> after = eventsOf(live, 1.0);
  ASSERT_EQ(after.size(), before.size());
  for (std::size_t index = 0; index < after.size(); ++index) {
    EXPECT_NEAR(after[index].time, before[index].time, 1e-9);
    EXPECT_LT((after[index].impulse - before[index].impulse).norm(),
              1e-6 * before[index].impulse.norm());
  }
  ASSERT_TRUE(live.rewind(-1.0));
  EXPECT_EQ(live.time(), 0.0);
  EXPECT_TRUE(live.run().portions.empty());
}

class LiveOnBoth : public testing::TestWithParam<StepperType> {};

TEST_P(LiveOnBoth, AThrownBallFliesOnItsParabola) {
  LiveRun live = begun(marbles(GetParam()));
  ASSERT_TRUE(live.advanceTo(0.5));
  const Vec3 from(-0.5, 1.0, 0.2);
  const Vec3 velocity(0.7, 2.0, -0.3);
  const Result<BodyId> thrown = live.add(ball(from, velocity));
  ASSERT_TRUE(thrown) << thrown.error().message;
  EXPECT_EQ(*thrown, 3u);
  const double begin = live.time();
  ASSERT_TRUE(live.advanceTo(begin + 0.4));
  const double time = live.time() - begin;
  const Vec3 wanted = from + time * velocity + 0.5 * time * time * Vec3(0.0, -9.81, 0.0);
  // Bullet's semi-implicit step falls g h t / 2 deeper.
  const double within = GetParam() == StepperType::native ? 1e-9 : 9.81 * time / 500.0;
  EXPECT_LT((sphereAt(live, *thrown).position - wanted).norm(), within);
  EXPECT_EQ(live.run().bodies.back().bodies.front().name, "thrown");
  // Where it lands it is heard.
  ASSERT_TRUE(live.advanceTo(begin + 1.0));
  const auto all = eventsOf(live, 10.0);
  EXPECT_TRUE(
      std::ranges::any_of(all, [&](const ImpulseEvent& event) { return event.body == *thrown; }));
  // It is gone where it had not come yet.
  ASSERT_TRUE(live.rewind(0.3));
  EXPECT_EQ(live.run().bodies.size(), 1u);
  EXPECT_EQ(live.now().bodies.size(), 3u);
}

TEST_P(LiveOnBoth, APulledBallComesToTheHand) {
  LiveRun live = begun(marbles(GetParam()));
  const Vec3 hand(0.3, 0.8, -0.2);
  live.pull(Pull{.body = 1, .place = hand});
  ASSERT_TRUE(live.advanceTo(1.5));
  EXPECT_LT((sphereAt(live, 1).position - hand).norm(), 5e-3);
  live.pull({});
  ASSERT_TRUE(live.advanceTo(1.7));
  EXPECT_LT(sphereAt(live, 1).position.y(), 0.7);
  live.push(1, {0.0, 5.0, 0.0});
  ASSERT_TRUE(live.advanceTo(1.8));
  EXPECT_GT(sphereAt(live, 1).velocity.y(), 1.0);
}

TEST_P(LiveOnBoth, SettingsBecomeOthersOnTheWay) {
  LiveRun live = begun(marbles(GetParam()));
  ASSERT_TRUE(live.advanceTo(0.1));
  ASSERT_TRUE(live.change([](Scene& scene) { scene.gravity = Vec3(0.0, 0.0, -2.0); }));
  const double begin = live.time();
  const Vec3 velocity = sphereAt(live, 2).velocity;
  ASSERT_TRUE(live.advanceTo(begin + 0.2));
  const Vec3 gained = sphereAt(live, 2).velocity - velocity;
  EXPECT_LT((gained - (live.time() - begin) * Vec3(0.0, 0.0, -2.0)).norm(), 1e-6);
}

INSTANTIATE_TEST_SUITE_P(Steppers, LiveOnBoth,
                         testing::Values(StepperType::native, StepperType::bullet),
                         [](const auto& one) {
                           return one.param == StepperType::native ? "Native" : "Bullet";
                         });

TEST(LiveRuns, ABodyInAnotherIsRefusedAndNothingChanges) {
  LiveRun live = begun(marbles());
  ASSERT_TRUE(live.advanceTo(0.2));
  const Vec3 place = sphereAt(live, 1).position;
  EXPECT_FALSE(live.add(ball(place, Vec3::Zero())));
  EXPECT_EQ(live.now().bodies.size(), 3u);
  EXPECT_EQ(sphereAt(live, 1).position, place);
  EXPECT_TRUE(live.advanceTo(0.3));
}

TEST(LiveRuns, AJelloIsPulled) {
  LiveRun live = begun(libraryScene("jello_drop"));
  BodyId jello = 0;
  const auto& bodies = live.scene().bodies;
  for (std::size_t index = 0; index < bodies.size(); ++index)
    if (std::holds_alternative<std::shared_ptr<const JelloShape>>(bodies[index].shape))
      jello = static_cast<BodyId>(index);
  const auto placeOf = [&] {
    const Scene scene = live.now();
    return std::get<std::shared_ptr<const JelloShape>>(scene.bodies[jello].shape)->positions[0];
  };
  ASSERT_TRUE(live.advanceTo(0.05));
  const Vec3 hand = placeOf() + Vec3(0.0, 0.1, 0.0);
  live.pull(Pull{.body = jello, .point = 0, .place = hand, .rate = 40.0});
  ASSERT_TRUE(live.advanceTo(0.6));
  const double held = (placeOf() - hand).norm();
  live.pull({});
  ASSERT_TRUE(live.rewind(0.05));
  ASSERT_TRUE(live.advanceTo(0.6));
  EXPECT_LT(held, 0.5 * (placeOf() - hand).norm());
  // States go on in their steps across what was taken back.
  std::size_t states = 0;
  for (const RunPortion& portion : live.run().portions)
    states += portion.deformations.size();
  EXPECT_NEAR(static_cast<double>(states) * live.run().deformationStep, live.time(), 5e-3);
}

}  // namespace
}  // namespace carom::scenes
