// Limits of runs, and where a sound ends.

#include "scenes/limits/run_guard.h"

#include <cmath>
#include <fstream>
#include <vector>

#include "lab/estimate/run_estimate.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "carom/modal/mesh_analysis.h"
#include "scenes/format/scene_loader.h"
#include "scenes/limits/sound_end.h"
#include "scenes/recording/event_tape.h"
#include "scenes/run/render.h"
#include "scenes/run/scene_modes.h"
#include "tests/scenes/library.h"
#include "tests/support/recording.h"
#include "tests/support/temporary_folder.h"

namespace carom::test {

using namespace scenes;

namespace {

using testing::HasSubstr;

/// A ball of 100 m/s in a gap between two planes, without loss.
Scene ballInGap(double gap, double duration) {
  const std::string text = R"({"duration": )" + std::to_string(duration) +
                           R"(, "gravity": [0, 0, 0], "listeners": [{"position": [0, 1, 1]}],
      "materials": {"hard": {"like": "steel", "restitution": 1}}, "bodies": [
      {"type": "sphere", "name": "ball", "radius": 0.01, "material": "hard",
       "position": [0, )" + std::to_string(0.01 + 0.5 * gap) +
                           R"(, 0], "velocity": [0, 100, 0]},
      {"type": "plane", "name": "floor", "normal": [0, 1, 0], "offset": 0, "material": "hard"},
      {"type": "plane", "name": "lid", "normal": [0, -1, 0], "offset": )" +
                           std::to_string(-0.02 - gap) + R"(, "material": "hard"}]})";
  Result<Scene> scene = parseScene(text, "gap.json");
  EXPECT_TRUE(scene) << scene.error().message;
  return *scene;
}

/// A ball that rings long, which falls on a floor just before the end.
Scene ringingBall() {
  const std::string model = CAROM_SOURCE_DIR "/tests/fuzz/corpus/modal_model/bar.carom_modes";
  const std::string text = R"({"duration": 0.3, "listeners": [{"position": [0, 0.1, 0.5]}],
      "bodies": [{"type": "sphere", "radius": 0.02, "material": "steel", "position": [0, 0.2, 0],
                  "modes": ")" +
                           model +
                           R"("},
                 {"type": "plane", "normal": [0, 1, 0], "offset": 0, "material": "steel"}]})";
  Result<Scene> scene = parseScene(text, "ringing.json");
  EXPECT_TRUE(scene) << scene.error().message;
  return *scene;
}

RenderReport rendering(const Scene& scene, const RenderOptions& options) {
  const Result<RenderReport> report = renderScene(scene, options);
  EXPECT_TRUE(report) << report.error().message;
  return report ? *report : RenderReport{};
}

// In a gap of 2 um the ball hits 5e7 times a second, which nobody hears. That took all memory.
TEST(RunGuard, AnEndlessRattleEndsTheRunAndIsNamed) {
  const TemporaryFolder folder;
  const Scene scene = ballInGap(2e-6, 1.0);
  RunGuard guard(scene, {});
  const RenderReport report = rendering(scene, {.soundFile = folder / "gap.wav", .guard = &guard});
  ASSERT_TRUE(report.endedEarly);
  EXPECT_EQ(report.endedEarly->limit, "rattle");
  EXPECT_EQ(report.endedEarly->pointer, "/bodies/0");
  EXPECT_THAT(report.endedEarly->what, HasSubstr("\"ball\" (/bodies/0) rattles without end"));
  // A collision comes every gap / speed.
  EXPECT_NEAR(report.endedEarly->time, RunGuard::kRattle * 2e-6 / 100.0, 1e-5);
  EXPECT_EQ(folder.entries(), 0U);
}

TEST(RunGuard, AFastRattleOfFewIsNone) {
  const TemporaryFolder folder;
  const Scene scene = ballInGap(2e-6, 0.0019);  // 95,000 collisions
  RunGuard guard(scene, {});
  const RenderReport report = rendering(scene, {.soundFile = folder / "gap.wav", .guard = &guard});
  EXPECT_FALSE(report.endedEarly);
  EXPECT_NEAR(static_cast<double>(report.events), 2.0 * 95'000.0, 10.0);
}

TEST(RunGuard, TheNumberOfEventsIsALimit) {
  const TemporaryFolder folder;
  const Scene scene = ballInGap(2e-6, 1.0);
  RunGuard guard(scene, {.events = 1'000'000});  // beyond a rattle, which is asked for then
  const RenderReport report = rendering(scene, {.soundFile = folder / "gap.wav", .guard = &guard});
  ASSERT_TRUE(report.endedEarly);
  EXPECT_EQ(report.endedEarly->limit, "events");
  EXPECT_EQ(guard.events(), 1'000'000U);
  EXPECT_THAT(report.endedEarly->what, HasSubstr("expected at most 1000000 (--max-events)"));
}

TEST(RunGuard, CountsTheEventsOfAnotherRunAnew) {
  const Scene scene = ballInGap(1e-3, 0.1);
  RunGuard guard(scene, {.events = 15'000});  // a run of 0.1 s has 20,000
  for (int run = 0; run < 3; ++run) {
    guard.restart();
    const auto stepper = makeStepper(scene, &guard);
    ASSERT_TRUE(stepper);
    EXPECT_TRUE(recordTape(**stepper, 0.05, &guard));
    EXPECT_NEAR(static_cast<double>(guard.events()), 10'000.0, 10.0);
  }
  const auto stepper = makeStepper(scene, &guard);
  ASSERT_TRUE(stepper);
  const auto tape = recordTape(**stepper, 0.1, &guard);
  ASSERT_FALSE(tape);
  EXPECT_THAT(tape.error().message, HasSubstr("expected at most 15000 (--max-events)"));
}

// A part that a limit cuts off is the beginning of the whole, under another name.
TEST(RunGuard, APartThatIsKeptIsTheBeginningOfTheWhole) {
  const TemporaryFolder folder;
  const Scene scene = libraryScene("marbles_in_a_box");
  const RenderReport whole = rendering(scene, {.soundFile = folder / "whole.wav"});
  RunGuard guard(scene, {.events = whole.events / 2});
  const RenderReport part =
      rendering(scene, {.soundFile = folder / "part.wav", .guard = &guard, .keepPartial = true});
  ASSERT_TRUE(part.endedEarly);
  EXPECT_EQ(part.file, folder / "part.incomplete.wav");
  EXPECT_FALSE(std::filesystem::exists(folder / "part.wav"));
  const Recording kept = readRecording(part.file);
  const Recording all = readRecording(folder / "whole.wav");
  ASSERT_LT(kept.samples.size(), all.samples.size());
  ASSERT_GT(kept.samples.size(), 0U);
  EXPECT_TRUE(std::equal(kept.samples.begin(), kept.samples.end(), all.samples.begin()));
}

// Such a file may be what a recording has left.
TEST(RunGuard, APartReplacesNoOtherThatIsThere) {
  const TemporaryFolder folder;
  std::ofstream(folder / "part.incomplete.wav") << "kept before";
  const Scene scene = libraryScene("marbles_in_a_box");
  for (const int number : {2, 3}) {
    RunGuard guard(scene, {.events = 20});
    const RenderReport part =
        rendering(scene, {.soundFile = folder / "part.wav", .guard = &guard, .keepPartial = true});
    EXPECT_EQ(part.file, folder / ("part.incomplete-" + std::to_string(number) + ".wav"));
  }
  rendering(scene, {.soundFile = folder / "part.wav", .keepPartial = true});
  EXPECT_EQ(contents(folder / "part.incomplete.wav"), "kept before");
  EXPECT_EQ(folder.entries(), 4U);
}

TEST(RunGuard, ARunWithinItsLimitsIsTheSameAndHasItsName) {
  const TemporaryFolder folder;
  for (const Scene& scene : {libraryScene("newtons_cradle"), ringingBall()}) {
    rendering(scene, {.soundFile = folder / "free.wav"});
    RunGuard guard(scene, {.memory = std::uint64_t{1} << 40U, .time = 1e6, .events = 1 << 30});
    const RenderReport report =
        rendering(scene, {.soundFile = folder / "bound.wav", .guard = &guard, .keepPartial = true});
    EXPECT_FALSE(report.endedEarly);
    EXPECT_EQ(report.file, folder / "bound.wav");
    EXPECT_EQ(contents(folder / "free.wav"), contents(folder / "bound.wav"));
    EXPECT_EQ(folder.entries(), 2U);
  }
}

// ---- Estimates

TEST(RunEstimate, StepsAreDurationOverStep) {
  Scene scene = onStepper(libraryScene("two_balls"), StepperType::bullet);
  scene.duration = 3600.0;
  scene.stepper.step = 1e-5;
  const lab::RunEstimate estimate = lab::estimateRun(scene);
  EXPECT_NEAR(estimate.steps, 3.6e8, 1.0);
  EXPECT_THAT(lab::longRunWarning(estimate), HasSubstr("/stepper/step"));
}

TEST(RunEstimate, CollisionsGoOnAsTheyBegin) {
  const lab::RunEstimate estimate = lab::estimateRun(ballInGap(1e-3, 10.0));
  ASSERT_TRUE(estimate.events);
  EXPECT_NEAR(*estimate.events, 2.0 * 10.0 * 100.0 / 1e-3, 0.02 * 2e6);  // two of each collision
}

/// A box that rings, by an analysis of about so many degrees of freedom.
Scene ringingBox(std::size_t degreesOfFreedom, int count = 1) {
  std::string bodies;
  for (int box = 0; box < count; ++box)
    bodies += R"({"type": "solid", "name": "box)" + std::to_string(box) +
              R"(", "material": "glass", "position": [0, )" + std::to_string(1 + box) +
              R"(, 0], "shape": {"type": "box", "half_extents": [0.1, 0.05, 0.02]},
               "modes": {"dofs": )" +
              std::to_string(degreesOfFreedom) + R"(, "count": 5, "panels": 100}},)";
  const std::string text = R"({"duration": 0.1, "listeners": [{"position": [0, 1, 1]}],
      "stepper": {"type": "bullet"}, "bodies": [)" +
                           bodies +
                           R"({"type": "plane", "normal": [0, 1, 0], "offset": 0,
                               "material": "steel"}]})";
  Result<Scene> scene = parseScene(text, "ringing_box.json");
  EXPECT_TRUE(scene) << scene.error().message;
  return *scene;
}

// The analysis itself counts what it solves; it makes its grid as fine as comes near the number
// from below.
TEST(RunEstimate, DegreesOfFreedomAreThoseOfTheAnalysis) {
  for (const std::size_t wished : {500U, 3000U}) {
    const Scene scene = ringingBox(wished);
    const std::vector<ModesToCompute> models = modesToCompute(scene);
    ASSERT_EQ(models.size(), 1U);
    const auto analysis =
        analyseMesh(models[0].surface, scene.bodies[0].material, scene.bodies[0].ringing->analysis);
    ASSERT_TRUE(analysis) << analysis.error().message;
    const double counted = static_cast<double>(analysis->degreesOfFreedom.value());
    const double told = lab::estimateRun(scene).degreesOfFreedom;
    EXPECT_GE(told, counted);
    EXPECT_LE(told, 2.0 * counted);
  }
}

TEST(RunEstimate, AModelThatBodiesShareIsComputedOnce) {
  const double one = lab::estimateRun(ringingBox(3000)).degreesOfFreedom;
  EXPECT_EQ(lab::estimateRun(ringingBox(3000, 4)).degreesOfFreedom, one);
}

// A sparse factor of a grid has more numbers than it has unknowns, and fewer than a full one.
TEST(RunEstimate, ModesTakeMemoryBetweenThatOfADiagonalAndOfAFullMatrix) {
  constexpr double kMany = 100'000.0;
  const double more =
      lab::estimateRun(ringingBox(100'000)).memory - lab::estimateRun(ringingBox(500)).memory;
  EXPECT_GT(more, 100.0 * sizeof(double) * kMany);
  EXPECT_LT(more, 0.1 * sizeof(double) * kMany * kMany);
}

TEST(RunEstimate, ModesThatTakeLongAreToldBefore) {
  EXPECT_EQ(lab::longRunWarning(lab::estimateRun(ringingBox(3000))), "");
  EXPECT_THAT(lab::longRunWarning(lab::estimateRun(ringingBox(1'000'000))),
              HasSubstr("the modes of \"box0\" (/bodies/0), of 1e+06 degrees of freedom"));
}

TEST(RunEstimate, NoSceneOfTheLibraryTakesAMinute) {
  for (const auto name : kLibrary)
    EXPECT_EQ(lab::longRunWarning(lab::estimateRun(libraryScene(name))), "") << name;
}

// ---- The end of a sound

TEST(SoundEnd, IsQuietSixtyDecibelsBelowThePeakForFiftyMilliseconds) {
  SoundEnd end(1000.0);
  std::vector<std::vector<float>> channels(2, std::vector<float>(50, 0.0F));
  channels[1][10] = -1.0F;
  end.add(channels, 50);
  EXPECT_FALSE(end.isQuiet());
  EXPECT_EQ(end.level(), 0.0);
  channels[1].assign(50, 0.0F);
  channels[0].assign(50, 0.0011F);
  end.add(channels, 50);
  EXPECT_FALSE(end.isQuiet());
  EXPECT_NEAR(end.level(), 20.0 * std::log10(0.0011), 1e-5);
  channels[0].assign(50, 0.0009F);
  end.add(channels, 49);
  EXPECT_FALSE(end.isQuiet());  // one louder sample is within 50 ms
  end.add(channels, 1);
  EXPECT_TRUE(end.isQuiet());
}

TEST(SoundEnd, AFadeFallsFromAllToNothingOverTheLastFiftyMilliseconds) {
  const SoundEnd end(1000.0);
  std::vector<std::vector<float>> channels(1, std::vector<float>(100, 1.0F));
  end.fade(channels, 100, 900, 1000);
  for (std::size_t frame = 0; frame <= 49; ++frame)
    EXPECT_EQ(channels[0][frame], 1.0F);
  for (std::size_t frame = 51; frame < 100; ++frame)
    EXPECT_LT(channels[0][frame], channels[0][frame - 1]);
  EXPECT_EQ(channels[0][99], 0.0F);
}

// A body that rings at the scene's end rings on until it is quiet, and what comes before is the
// same.
TEST(SoundEnd, WhatRingsIsHeardToItsEnd) {
  const TemporaryFolder folder;
  const Scene scene = ringingBall();
  const RenderReport cut = rendering(scene, {.soundFile = folder / "cut.wav"});
  const RenderReport whole = rendering(scene, {.soundFile = folder / "whole.wav", .tail = 60.0});
  EXPECT_GT(cut.levelAtEnd, -60.0);
  EXPECT_LE(whole.levelAtEnd, -60.0);
  EXPECT_GT(whole.duration, scene.duration);
  EXPECT_LE(whole.duration, scene.duration + 60.0);
  const Recording shorter = readRecording(folder / "cut.wav");
  const Recording longer = readRecording(folder / "whole.wav");
  ASSERT_LT(shorter.samples.size(), longer.samples.size());
  EXPECT_TRUE(std::equal(shorter.samples.begin(), shorter.samples.end(), longer.samples.begin()));
}

TEST(SoundEnd, WhatRingsLongerFades) {
  const TemporaryFolder folder;
  const Scene scene = ringingBall();
  for (const double tail : {0.0, 0.1}) {
    const RenderReport report = rendering(scene, {.soundFile = folder / "faded.wav", .tail = tail});
    EXPECT_NEAR(report.duration, scene.duration + tail, 1.0 / scene.sampleRate);
    const Recording faded = readRecording(folder / "faded.wav");
    EXPECT_EQ(faded.samples.back(), 0.0);
  }
}

}  // namespace
}  // namespace carom::test
