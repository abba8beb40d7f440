#include "lab/compare/compare.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/scenes/library.h"

namespace carom::test {

using namespace lab;
using namespace scenes;

namespace {

CompareReport compared(const Scene& scene, const std::vector<double>& steps) {
  const Result<CompareReport> report = compareScene(scene, steps);
  EXPECT_TRUE(report) << report.error().message;
  return report ? *report : CompareReport{};
}

void expectAllMatched(const CompareRun& run) {
  EXPECT_EQ(run.local.matched, run.local.reference);
  EXPECT_EQ(run.local.missed, 0u);
  EXPECT_EQ(run.local.spurious, 0u);
  EXPECT_LT(run.local.timeError.max, 1e-6);
  EXPECT_LT(run.local.impulseError.max, 1e-3);
  EXPECT_LE(run.local.timeError.rms, run.local.timeError.max);
  EXPECT_LE(run.local.impulseError.rms, run.local.impulseError.max);
}

TEST(Compare, TheBridgeRecoversTheOneCollisionOfTwoBalls) {
  const CompareReport report = compared(libraryScene("two_balls"), {0.016667});
  EXPECT_EQ(report.nativeCollisions, 1u);
  ASSERT_EQ(report.runs.size(), 1u);
  const CompareRun& run = report.runs[0];
  EXPECT_EQ(run.step, 0.016667);
  EXPECT_EQ(run.local.reference, 1u);
  expectAllMatched(run);
  // Free flight without gravity is a straight line for both steppers.
  EXPECT_EQ(run.global.compared, 1u);
  EXPECT_LT(run.global.difference.max, 1e-6);
  EXPECT_TRUE(std::isinf(run.global.divergedAt));
  EXPECT_NEAR(run.levelDifference, 0.0, 0.05);
}

class EveryLibraryScene : public testing::TestWithParam<std::string> {};

// The scenes are dense and sparse, with speculative contacts, tunnelling, piles and rest.
TEST_P(EveryLibraryScene, IsHeardByTheBridgeCollisionByCollisionAtAnyStep) {
  Scene scene = libraryScene(GetParam());
  scene.duration = std::min(scene.duration, 2.5);
  const CompareReport report = compared(scene, {1.0 / 60.0, 1.0 / 240.0, 1.0 / 1000.0});
  ASSERT_EQ(report.runs.size(), 3u);
  for (const CompareRun& run : report.runs) {
    SCOPED_TRACE(run.step);
    EXPECT_GE(run.local.reference, 1u);
    expectAllMatched(run);
  }
}

INSTANTIATE_TEST_SUITE_P(Library, EveryLibraryScene,
                         testing::Values("bouncing_ball", "two_balls", "newtons_cradle",
                                         "billiard_break", "marbles_in_a_box", "marbles_in_a_room",
                                         "fly_by", "marble_steps"),
                         [](const auto& scene) { return scene.param; });

TEST(Compare, DifferencesFromTheNativeRunEndWhereTheRunsPart) {
  const CompareReport report = compared(libraryScene("newtons_cradle"), {1.0 / 240.0});
  ASSERT_EQ(report.runs.size(), 1u);
  const CompareRun& run = report.runs[0];
  // Bullet resolves the collisions of one step together, so that the fifth native collision has no
  // counterpart. It is at 0.5007 s: solved by hand for e = 0.9 and gaps of 1 mm.
  EXPECT_LT(run.global.divergedAt, 0.5007);
  EXPECT_LE(run.global.compared, report.nativeCollisions);
  EXPECT_LE(run.global.difference.max, 4.0 * run.step + 0.01);  // beyond, the runs have parted
}

TEST(Compare, ASceneWithoutCollisionsHasNothingToMiss) {
  Scene scene = libraryScene("two_balls");
  scene.duration = 0.4;  // they touch at 0.4037 s
  const CompareReport report = compared(scene, {1.0 / 60.0});
  EXPECT_EQ(report.nativeCollisions, 0u);
  ASSERT_EQ(report.runs.size(), 1u);
  EXPECT_EQ(report.runs[0].local.reference, 0u);
  EXPECT_EQ(report.runs[0].local.spurious, 0u);
  EXPECT_EQ(report.runs[0].local.timeError.max, 0.0);
  EXPECT_TRUE(std::isinf(report.runs[0].global.divergedAt));
  EXPECT_FALSE(std::isfinite(report.runs[0].levelDifference));  // silence has no level
}

TEST(Compare, TheScenesOwnStepperDoesNotMatter) {
  const std::vector<double> steps = {1.0 / 120.0};
  for (const Scene& scene : {libraryScene("two_balls"), libraryScene("newtons_cradle")}) {
    const CompareReport one = compared(onStepper(scene, StepperType::native), steps);
    const CompareReport two = compared(onStepper(scene, StepperType::bullet, 0.05), steps);
    EXPECT_EQ(one.nativeCollisions, two.nativeCollisions);
    EXPECT_EQ(one.runs.at(0).local.reference, two.runs.at(0).local.reference);
    EXPECT_EQ(one.runs.at(0).local.timeError.max, two.runs.at(0).local.timeError.max);
    EXPECT_EQ(one.runs.at(0).levelDifference, two.runs.at(0).levelDifference);
  }
}

TEST(Compare, TellsItsProgressUpToTheEnd) {
  std::vector<double> shares;
  const std::array steps = {0.02, 0.01};
  ASSERT_TRUE(compareScene(libraryScene("two_balls"), steps,
                           {.progress = [&](double share) { shares.push_back(share); }}));
  ASSERT_FALSE(shares.empty());
  EXPECT_TRUE(std::ranges::is_sorted(shares));
  EXPECT_EQ(shares.back(), 1.0);
}

// With the tuned settings, Bullet leaves impulses of earlier steps in contact points that its
// solver no longer works on.
TEST(Compare, TunedBulletBouncesDownToRestAsTheExactPathSays) {
  Scene scene = libraryScene("bouncing_ball");
  scene.stepper.tuned = true;
  const CompareReport report = compared(scene, {1.0 / 240.0, 1.0 / 1000.0});
  for (const CompareRun& run : report.runs) {
    EXPECT_GE(run.local.reference, 15u) << run.step;
    EXPECT_EQ(run.local.missed, 0u) << run.step;
    EXPECT_EQ(run.local.spurious, 0u) << run.step;
    EXPECT_LT(run.local.timeError.max, 1e-6) << run.step;
    EXPECT_LT(run.local.impulseError.max, 1e-3) << run.step;
  }
}

}  // namespace
}  // namespace carom::test
