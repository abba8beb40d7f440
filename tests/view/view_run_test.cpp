#include "lab/view/view_run.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "lab/view/held_scene.h"
#include "lab/view/view_page.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "audio/io/byte_file.h"
#include "scenes/format/scene_loader.h"
#include "scenes/recording/recorded_run.h"
#include "tests/support/temporary_folder.h"

namespace carom::lab {

using namespace audio;
using namespace scenes;

namespace {

using test::TemporaryFolder;
using testing::HasSubstr;

std::filesystem::path fileOf(const std::string& scene) {
  return std::filesystem::path(CAROM_SOURCE_DIR) / "scenes/library" / (scene + ".json");
}

TEST(ViewRuns, HoldTheFallOfABall) {
  // The poses that are left out lie between the others: z = h - g t^2 / 2 within what is seen.
  Result<Scene> scene = loadScene(fileOf("bouncing_ball"));
  ASSERT_TRUE(scene);
  const auto isBall = [](const SceneBody& body) { return isSphere(body); };
  const auto body = std::ranges::find_if(scene->bodies, isBall) - scene->bodies.begin();
  const auto& ball = std::get<SphereShape>(scene->bodies[static_cast<std::size_t>(body)].shape);
  const Result<ViewRun> view = viewScene(*scene);
  ASSERT_TRUE(view) << view.error().message;
  const std::vector<ListenerPose>& poses = view->poses[static_cast<std::size_t>(body)];
  ASSERT_GT(poses.size(), 10u);
  double firstHit = scene->duration;
  for (const RunPortion& portion : view->run.portions)
    for (const ImpulseEvent& event : portion.events)
      firstHit = std::min(firstHit, event.time);
  std::size_t between = 0;
  for (double time = 0.0; time < firstHit; time += 1e-3, ++between) {
    const auto after = std::ranges::lower_bound(poses, time, {}, &ListenerPose::time);
    ASSERT_NE(after, poses.end());
    if (after == poses.begin()) continue;
    const ListenerPose& before = *std::prev(after);
    const double share = (time - before.time) / (after->time - before.time);
    const Vec3 drawn = before.position + share * (after->position - before.position);
    const Vec3 exact = ball.position + time * ball.velocity + 0.5 * time * time * scene->gravity;
    if (after->time < firstHit) {
      EXPECT_LT((drawn - exact).norm(), 5e-3 * ball.radius) << time;
    }
  }
  EXPECT_GT(between, 100u);
}

TEST(ViewRuns, AsToldAreAtTheEndsOfSteps) {
  Result<Scene> scene = loadScene(fileOf("two_balls"));
  ASSERT_TRUE(scene);
  scene->stepper.type = StepperType::bullet;
  scene->stepper.step = 1.0 / 60.0;
  const Result<ViewRun> exact = viewScene(*scene);
  hearAsTold(*scene);
  const double step = scene->stepper.step;
  const Result<ViewRun> told = viewScene(
      *scene, {.heardAt = [step](const ImpulseEvent& event) { return endOfStep(event, step); }});
  ASSERT_TRUE(exact && told);
  const auto order = eventsInOrder(told->run);
  const auto knownOrder = eventsInOrder(exact->run);
  ASSERT_FALSE(order.empty());
  ASSERT_EQ(order.size(), told->events.size());
  ASSERT_EQ(order.size(), knownOrder.size());
  for (std::size_t index = 0; index < order.size(); ++index) {
    const auto& [portion, at] = order[index];
    const auto& [knownPortion, knownAt] = knownOrder[index];
    const ImpulseEvent& event = told->run.portions[portion].events[at];
    const ImpulseEvent& known = exact->run.portions[knownPortion].events[knownAt];
    EXPECT_EQ(event.body, known.body);
    EXPECT_NEAR(std::remainder(event.time, 1.0 / 60.0), 0.0, 1e-9);
    EXPECT_GE(event.time, known.time);
    EXPECT_LE(event.time, known.time + 1.0 / 60.0);
  }
}

TEST(ViewRuns, SlidesAreBars) {
  Result<Scene> scene = loadScene(fileOf("box_slides_to_rest"));
  ASSERT_TRUE(scene);
  const Result<ViewRun> view = viewScene(*scene);
  ASSERT_TRUE(view) << view.error().message;
  ASSERT_FALSE(view->contacts.empty());
  const auto longest = std::ranges::max_element(
      view->contacts, {}, [](const ContactBar& bar) { return bar.end - bar.begin; });
  EXPECT_TRUE(longest->slides);
  EXPECT_GT(longest->end - longest->begin, 0.2);
  // It carries the box's weight: m g on a level floor.
  double mass = 0.0;
  for (const HostBody& body : view->run.bodies.front().bodies)
    if (std::isfinite(body.sound.mass)) mass = body.sound.mass;
  EXPECT_NEAR(longest->meanForce, mass * 9.81, 0.1 * mass * 9.81);
}

TEST(ViewRuns, ThatWereRecordedAreThoseOfTheirScenes) {
  const TemporaryFolder folder;
  for (const std::string name : {"jello_drop", "coin_spin", "two_balls", "dropped_wrench"}) {
    Result<Scene> scene = loadScene(fileOf(name));
    ASSERT_TRUE(scene);
    const std::string text = *readSceneText(fileOf(name));
    const auto file = folder / (name + ".carom");
    ASSERT_TRUE(recordRun({&*scene, text, fileOf(name).string(), file}, {}, nullptr));
    const Result<ViewRun> recorded = viewRecorded(file, false);
    const Result<ViewRun> run = viewScene(*scene);
    ASSERT_TRUE(recorded && run);
    EXPECT_TRUE(*encodedRun(recorded->run) == *encodedRun(run->run)) << name;
    EXPECT_EQ(recorded->stepper, run->stepper);
    EXPECT_EQ(recorded->pictures.size(), run->pictures.size());
    EXPECT_EQ(recorded->contacts.size(), run->contacts.size());
  }
}

std::string textOf(const std::filesystem::path& file) {
  const Result<std::vector<std::byte>> bytes = readBytes(file);
  EXPECT_TRUE(bytes);
  return {reinterpret_cast<const char*>(bytes->data()), bytes->size()};
}

// With its files beside it, and nothing else, it moves as the scene does, to the bit.
TEST(HeldScenes, MoveAsTheSceneDoes) {
  for (const char* const name : {"dropped_wrench", "glass_and_plate", "pen_scrapes_brick"}) {
    const Result<HeldScene> held = heldScene(textOf(fileOf(name)), fileOf(name));
    ASSERT_TRUE(held) << held.error().message;
    const TemporaryFolder folder;
    for (const HeldFile& file : held->files)
      ASSERT_TRUE(writeBytes(folder / file.name, file.bytes));
    Result<Scene> scene = loadScene(fileOf(name));
    Result<Scene> alone =
        parseScene(held->text, (folder / "scene.json").string(), {.confined = true});
    ASSERT_TRUE(scene);
    ASSERT_TRUE(alone) << alone.error().message;
    scene->duration = alone->duration = 0.6;
    const Result<ViewTape> tape = recordView(*scene);
    const Result<ViewTape> same = recordView(*alone);
    ASSERT_TRUE(tape && same);
    ASSERT_EQ(same->portions.size(), tape->portions.size());
    std::size_t events = 0;
    for (std::size_t portion = 0; portion < tape->portions.size(); ++portion) {
      const auto& told = tape->portions[portion].events;
      ASSERT_EQ(same->portions[portion].events.size(), told.size()) << name;
      for (std::size_t event = 0; event < told.size(); ++event, ++events) {
        EXPECT_EQ(same->portions[portion].events[event].time, told[event].time) << name;
        EXPECT_EQ(same->portions[portion].events[event].impulse, told[event].impulse) << name;
      }
    }
    EXPECT_GT(events, 1u) << name;
  }
}

TEST(HeldScenes, AreTheirTextWhereNoFileIsNamed) {
  const std::string text = textOf(fileOf("bouncing_ball"));
  const Result<HeldScene> held = heldScene(text, fileOf("bouncing_ball"));
  ASSERT_TRUE(held);
  EXPECT_EQ(held->text, text);
  EXPECT_TRUE(held->files.empty());
}

TEST(HeldScenes, AMeshThatIsGoneIsToldAndTheRunIsShownAllTheSame) {
  const TemporaryFolder folder;
  ViewRun view;
  setSceneText(view, textOf(fileOf("dropped_wrench")), folder / "moved.json");
  EXPECT_TRUE(view.sceneText.empty());
  EXPECT_THAT(view.notLive, HasSubstr("wrench.obj"));
}

class ViewPages : public testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(folder_ / "right.html") << "<html><!-- carom: runs --></html>";
    std::ofstream(folder_ / "wrong.html") << "<html></html>";
    const Result<Scene> scene = loadScene(fileOf("two_balls"));
    ASSERT_TRUE(scene);
    Result<ViewRun> view = viewScene(*scene);
    ASSERT_TRUE(view);
    view_ = *std::move(view);
  }
  ViewPage page() const {
    Result<ViewPage> page = ViewPage::create(folder_ / "right.html", "two");
    EXPECT_TRUE(page);
    return *std::move(page);
  }

  const TemporaryFolder folder_;
  ViewRun view_;
};

TEST_F(ViewPages, AreRefusedOnesTemplate) {
  const auto refused = ViewPage::create(folder_ / "wrong.html", "two");
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("no template"));
  EXPECT_FALSE(findTemplate("", {folder_ / "nowhere"}));
  EXPECT_FALSE(findTemplate(folder_ / "missing.html", {}));
}

TEST_F(ViewPages, HoldOnceWhatRunsShare) {
  ViewPage one = page();
  ASSERT_TRUE(one.add(view_));
  ViewPage three = page();
  for (const char* const id : {"a", "b", "c"}) {
    view_.id = id;
    ASSERT_TRUE(three.add(view_));
  }
  EXPECT_EQ(three.runs(), 3u);
  EXPECT_LT(three.bytes(), one.bytes() + 10'000);
  const Result<ViewReport> written = three.write(folder_ / "page.html");
  ASSERT_TRUE(written);
  EXPECT_EQ(written->bytes, std::filesystem::file_size(folder_ / "page.html"));
  EXPECT_GE(three.bytes(), written->bytes);
  EXPECT_LT(three.bytes(), written->bytes + 2'000);
}

TEST_F(ViewPages, LeaveOutARunThatWouldBeTooMuch) {
  ViewPage alone = page();
  ASSERT_TRUE(alone.add(view_));
  ASSERT_TRUE(alone.write(folder_ / "alone.html"));
  ViewPage full = page();
  ASSERT_TRUE(*full.add(view_));
  ViewRun other = view_;
  for (RunPortion& portion : other.run.portions)
    for (ImpulseEvent& event : portion.events)
      event.time += 1e-3;
  EXPECT_FALSE(*full.add(other, full.bytes() + 100));
  EXPECT_EQ(full.runs(), 1u);
  ASSERT_TRUE(full.write(folder_ / "full.html"));
  EXPECT_EQ(*readBytes(folder_ / "full.html"), *readBytes(folder_ / "alone.html"));
  EXPECT_TRUE(*full.add(other));
  EXPECT_EQ(full.runs(), 2u);
}

}  // namespace
}  // namespace carom::lab
