#include "lab/report/report.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "lab/report/report_files.h"
#include "lab/report/report_media.h"
#include "lab/report/report_run.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "scenes/run/bullet_only.h"
#include "scenes/run/native_only.h"
#include "tests/scenes/library.h"
#include "tests/support/csv.h"

namespace carom::test {

using namespace native;
using namespace lab;
using namespace scenes;

namespace {

using testing::HasSubstr;
using testing::Not;

/// A ball that bounces a few times.
Scene bounces() {
  Scene scene = libraryScene("bouncing_ball");
  scene.duration = 1.3;
  return scene;
}

SceneReport reported(const Scene& scene, ReportOptions options = {.runs = 1}) {
  Result<SceneReport> report = reportScene(scene, options);
  EXPECT_TRUE(report) << report.error().message;
  return report ? *std::move(report) : SceneReport{};
}

const SceneReport& bouncing() {
  static const SceneReport report = reported(bounces());
  return report;
}

const VariantReport& variant(const SceneReport& report, const std::string& id) {
  const auto found = std::ranges::find(report.variants, id,
                                       [](const VariantReport& one) { return one.choice.id; });
  EXPECT_NE(found, report.variants.end()) << id;
  return *found;
}

class Grids : public testing::TestWithParam<std::string> {};

TEST_P(Grids, HaveIdsOfTheirOwnAndTheReferenceOnce) {
  const Scene scene = libraryScene(GetParam());
  const Result<ReportGrid> grid = reportGrid(scene);
  ASSERT_TRUE(grid) << grid.error().message;
  std::set<std::string> ids = {grid->reference.id};
  for (const ReportChoice& choice : grid->variants) {
    EXPECT_TRUE(ids.insert(choice.id).second) << choice.id;
    EXPECT_EQ(choice.id.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_"),
              std::string::npos);
  }
  EXPECT_FALSE(grid->why.empty());
}

TEST_P(Grids, HoldOnlyWhatTheSceneCanBeRunAs) {
  const Scene scene = libraryScene(GetParam());
  const Result<ReportGrid> grid = reportGrid(scene);
  ASSERT_TRUE(grid) << grid.error().message;
  std::vector<ReportChoice> all = grid->variants;
  all.push_back(grid->reference);
  for (const ReportChoice& choice : all) {
    const Scene chosen = sceneOf(scene, choice);
    const bool onBullet = chosen.stepper.type == StepperType::bullet;
    EXPECT_TRUE(onBullet ? validateForBullet(chosen) : validateForNative(chosen)) << choice.id;
  }
}

INSTANTIATE_TEST_SUITE_P(Report, Grids,
                         testing::Values("bouncing_ball", "nine_ball_break", "dropped_wrench",
                                         "jello_and_marbles", "marbles_in_a_room"),
                         [](const auto& name) { return name.param; });

TEST(ReportGrid, IsExactFirst) {
  const Result<ReportGrid> native = reportGrid(libraryScene("two_balls"));
  ASSERT_TRUE(native);
  EXPECT_EQ(native->reference.stepper.type, StepperType::native);
  const Result<ReportGrid> solids = reportGrid(libraryScene("dropped_wrench"));
  ASSERT_TRUE(solids);
  EXPECT_EQ(solids->reference.stepper.type, StepperType::bullet);
  for (const ReportChoice& choice : solids->variants)
    EXPECT_GE(choice.stepper.step, solids->reference.stepper.step);
}

TEST(Report, TimesOfTheBridgeAreExactOnBulletsOwnPath) {
  for (const std::string id : {"bullet_60", "bullet_tuned_240", "bullet_1000"}) {
    const VariantReport& exact = variant(bouncing(), id);
    ASSERT_TRUE(exact.events) << id;
    EXPECT_EQ(exact.local, LocalKind::path);
    EXPECT_EQ(exact.events->missed + exact.events->spurious, 0u) << id;
    EXPECT_LT(exact.events->timeError.max, 1e-7) << id;
    EXPECT_LT(exact.localWaveformError.value(), 1e-3) << id;
  }
}

// An application that polls sees a contact after the step in which it occurs, up to two steps late.
TEST(Report, TimesOfStepsAreLateByAStepOrSo) {
  for (const int rate : {60, 240, 1000}) {
    const std::string id = "bullet_" + std::to_string(rate);
    const VariantReport& late = variant(bouncing(), id + "_step");
    ASSERT_TRUE(late.events);
    EXPECT_EQ(late.events->missed, 0u);
    EXPECT_LE(late.events->timeError.max, 2.001 / rate);
    EXPECT_GE(late.events->timeError.rms, 0.2 / rate);
    EXPECT_GT(late.localWaveformError.value(), 0.5);
    const VariantReport& backDated = variant(bouncing(), id + "_back_dated");
    EXPECT_LT(backDated.events->timeError.rms, 0.2 * late.events->timeError.rms);
  }
}

TEST(Report, ThePhysicalImpulseIsThatOfTheExactPathAndBulletsOwnIsNot) {
  EXPECT_LT(variant(bouncing(), "bullet_60").events->impulseError.max, 1e-6);
  EXPECT_GT(variant(bouncing(), "bullet_60_applied").events->impulseError.max, 0.05);
}

// The variants of sound have the reference's events.
TEST(Report, VariantsOfSoundAreComparedToTheEnd) {
  for (const VariantReport& one : bouncing().variants) {
    if (one.choice.group != VariantGroup::sound) continue;
    EXPECT_TRUE(std::isinf(one.divergedAt)) << one.choice.id;
    EXPECT_EQ(one.comparedUntil, bouncing().scene.duration);
    EXPECT_EQ(one.local, LocalKind::none);
    ASSERT_TRUE(one.waveformError) << one.choice.id;
    if (one.choice.id != "no_air")
      EXPECT_GT(*one.waveformError, 0.0) << one.choice.id;
    else  // the listener is so near that the air takes nothing
      EXPECT_EQ(*one.waveformError, 0.0);
    EXPECT_FALSE(one.energyDrift);
  }
}

TEST(Report, FinerStepsStayLongerWithTheReference) {
  EXPECT_LT(variant(bouncing(), "bullet_60").divergedAt, bouncing().scene.duration);
  EXPECT_GE(variant(bouncing(), "bullet_tuned_1000").divergedAt,
            variant(bouncing(), "bullet_60").divergedAt);
}

TEST(Report, ComparesOnlyUpToWhereRunsPart) {
  for (const VariantReport& one : bouncing().variants) {
    EXPECT_LE(one.comparedUntil, bouncing().scene.duration);
    EXPECT_LE(one.comparedUntil, one.divergedAt);
  }
}

TEST(Report, RunTimesAreOfBothStages) {
  for (const VariantReport& one : bouncing().variants) {
    EXPECT_GT(one.runTime.mechanics, 0.0) << one.choice.id;
    EXPECT_GT(one.runTime.sound, 0.0) << one.choice.id;
    EXPECT_EQ(one.runTime.total(), one.runTime.mechanics + one.runTime.sound);
    EXPECT_EQ(one.runTime.runs, 1u);
  }
}

std::size_t memoryOf(const Scene& scene) {
  const Result<MechanicsRun> run = runMechanics(scene, {.runs = 1});
  EXPECT_TRUE(run) << run.error().message;
  const Result<SoundRun> sound = runSound(scene, run->tape, {.runs = 1});
  EXPECT_TRUE(sound) << sound.error().message;
  return run->memory.value_or(0) + sound->memory.value_or(0);
}

// Neither stepper nor sound keeps past data.
TEST(Report, MemoryDoesNotGrowWithTheSceneLength) {
  Scene scene = bounces();
  const std::size_t shortRun = memoryOf(scene);
  if (shortRun == 0) GTEST_SKIP() << "this C library does not tell";
  scene.duration = 2.7;
  EXPECT_GT(shortRun, 10000u);
  EXPECT_LT(static_cast<double>(memoryOf(scene)), 1.1 * static_cast<double>(shortRun));
}

TEST(Report, LeavesOutWhatIsNotAffordable) {
  const SceneReport report = reported(bounces(), {.runs = 1, .budget = 1e-3});
  ASSERT_FALSE(report.leftOut.empty());
  for (const VariantLeftOut& entry : report.leftOut)
    EXPECT_THAT(entry.why, HasSubstr("would take about"));
  EXPECT_LT(report.variants.size(), bouncing().variants.size());
}

/// A jello with three points along each edge that is thrown onto the floor.
Scene smallJello() {
  return orAbort(parseScene(R"({
    "duration": 0.2, "gravity": [0, 0, -9.81],
    "bodies": [
      {"type": "plane", "name": "floor", "normal": [0, 0, 1], "offset": 0, "material": "wood"},
      {"type": "jello", "name": "cube", "points": 3, "size": [0.1, 0.1, 0.1], "mass": 0.1,
       "stiffness": 500, "damping": 0.2, "contact": {"stiffness": 500, "damping": 0.2},
       "position": [0, 0, 0.06], "velocity": [0, 0, -1]}
    ],
    "listeners": [{"position": [0, 0, 1]}]
  })",
                            "small_jello.json"));
}

TEST(Report, OfAJelloConvergesToItsReference) {
  const SceneReport report = reported(smallJello());
  std::map<JelloIntegrator, std::vector<std::pair<double, double>>> errors;
  for (const VariantReport& one : report.variants) {
    if (one.choice.group != VariantGroup::jello || !one.positionError) continue;
    errors[one.choice.jello->integrator].emplace_back(one.choice.jello->step, *one.positionError);
  }
  ASSERT_GE(errors.size(), 4u);
  for (auto& [integrator, list] : errors) {
    std::ranges::sort(list);
    EXPECT_LT(list.front().second, 0.8 * list.back().second) << nameOf(integrator);
    EXPECT_GT(list.front().second, 1e-12) << nameOf(integrator);
  }
}

TEST(Report, OfSolidsHoldsBulletAgainstItsBridge) {
  Scene scene = libraryScene("dropped_wrench");
  scene.duration = 0.5;
  for (SceneBody& body : scene.bodies)
    body.ringing.reset();
  const SceneReport report = reported(scene);
  const VariantReport& step = variant(report, "bullet_tuned_240_step");
  EXPECT_EQ(step.local, LocalKind::bridge);
  ASSERT_TRUE(step.events);
  EXPECT_GT(step.events->timeError.rms, 0.0);
  EXPECT_FALSE(variant(report, "bullet_tuned_240").events);
}

TEST(ReportFiles, JsonHasEveryVariantWithItsKeys) {
  const std::vector<SceneReport> scenes = {bouncing()};
  const nlohmann::ordered_json json = reportJson(scenes);
  EXPECT_EQ(json.at("format"), "carom report 1");
  const auto& scene = json.at("scenes").at(0);
  EXPECT_EQ(scene.at("variants").size(), bouncing().variants.size());
  EXPECT_EQ(scene.at("reference"), "native");
  for (const auto& one : scene.at("variants")) {
    for (const char* key : {"id",
                            "group",
                            "label",
                            "choices",
                            "run_time",
                            "memory",
                            "events",
                            "event_time_error",
                            "impulse_error",
                            "local_waveform_error",
                            "diverged_at",
                            "compared_until",
                            "waveform_error",
                            "waveform_error_db",
                            "aligned_waveform_error",
                            "delay",
                            "band_error_db",
                            "bands",
                            "energy_drift",
                            "position_error",
                            "notes"})
      EXPECT_TRUE(one.contains(key)) << key;
  }
}

TEST(ReportFiles, CsvHasARowForEachVariantAndTheSameNumbers) {
  const std::vector<SceneReport> scenes = {bouncing()};
  const auto rows = parseCsv(reportCsv(scenes));
  ASSERT_EQ(rows.size(), bouncing().variants.size() + 1);
  std::map<std::string, std::size_t> column;
  for (std::size_t i = 0; i < rows[0].size(); ++i)
    column[rows[0][i]] = i;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    ASSERT_EQ(rows[i].size(), rows[0].size());
    const VariantReport& one = bouncing().variants[i - 1];
    EXPECT_EQ(rows[i][column.at("scene")], "bouncing_ball");
    EXPECT_EQ(rows[i][column.at("label")], one.choice.label);
    EXPECT_EQ(numberOf(rows[i][column.at("run_time_sound")]), one.runTime.sound);
    const std::string& diverged = rows[i][column.at("diverged_at_s")];
    EXPECT_EQ(diverged.empty(), std::isinf(one.divergedAt));
  }
}

TEST(ReportFiles, ThePageHoldsAllAndAsksForNothing) {
  Scene scene = bounces();
  scene.name = "</script><b>";
  SceneReport report = bouncing();
  report.scene = scene;
  const std::vector<SceneReport> scenes = {report};
  const std::string page = reportHtml(scenes);
  EXPECT_THAT(page, Not(HasSubstr("<!--carom:")));
  EXPECT_THAT(page, Not(HasSubstr("</script><b>")));
  EXPECT_THAT(page, Not(HasSubstr("src=\"http")));
  EXPECT_THAT(page, Not(HasSubstr("href=\"http")));
  EXPECT_THAT(page, HasSubstr("data:audio/"));
}

// Test vectors of RFC 4648, section 10.
TEST(ReportMedia, Base64IsThatOfTheStandard) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foob"), "Zm9vYg==");
  EXPECT_EQ(base64("fooba"), "Zm9vYmE=");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64("\xFF\xFE\xFD"), "//79");
}

// An amplitude of 1 Pa is 94 - 3 dB.
TEST(ReportMedia, SpectrogramHasAToneInItsRowAtItsLevel) {
  std::vector<float> samples(48000);
  for (std::size_t frame = 0; frame < samples.size(); ++frame)
    samples[frame] = std::sin(2.0F * 3.14159265F * 1000.0F * static_cast<float>(frame) / 48000.0F);
  const Spectrogram picture = spectrogramOf(samples, 48000.0);
  ASSERT_EQ(picture.data.size(), picture.columns * picture.rows);
  const std::size_t middle = picture.columns / 2 * picture.rows;
  const auto levelAt = [&](std::size_t row) {
    return 100.0 * static_cast<double>(static_cast<unsigned char>(picture.data[middle + row])) /
           255.0;
  };
  std::size_t loudest = 0;
  for (std::size_t row = 0; row < picture.rows; ++row)
    if (levelAt(row) > levelAt(loudest)) loudest = row;
  const double ratio = 0.45 * 48000.0 / kLowestShown;
  const double expected = std::log(1000.0 / kLowestShown) / std::log(ratio);
  EXPECT_NEAR((static_cast<double>(loudest) + 0.5) / static_cast<double>(picture.rows), expected,
              1.0 / static_cast<double>(picture.rows));
  EXPECT_NEAR(levelAt(loudest), 20.0 * std::log10(std::sqrt(0.5) / 20e-6), 2.0);
  EXPECT_LT(levelAt(picture.rows - 1), 20.0);
}

// No click falls between two windows.
TEST(ReportMedia, SpectrogramShowsEveryClick) {
  for (std::size_t place = 20000; place < 21000; place += 37) {
    std::vector<float> samples(144000);
    samples[place] = 1.0F;
    const Spectrogram picture = spectrogramOf(samples, 48000.0);
    const std::size_t shown = static_cast<std::size_t>(
        std::ranges::count_if(picture.data, [](char byte) { return byte != 0; }));
    EXPECT_GT(shown, picture.rows / 2) << place;
  }
}

}  // namespace
}  // namespace carom::test
