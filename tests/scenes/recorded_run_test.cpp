#include "scenes/recording/recorded_run.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "audio/run/run_tables.h"
#include "scenes/format/scene_loader.h"
#include "scenes/recording/run_file.h"
#include "scenes/run/render.h"
#include "tests/scenes/damaged_runs.h"
#include "tests/scenes/library.h"
#include "tests/support/recording.h"
#include "tests/support/temporary_folder.h"

namespace carom::test {

using namespace audio;
using namespace scenes;

namespace {

using testing::HasSubstr;

class RecordedRuns : public testing::Test {
 protected:
  /// Records a scene of the library on its stepper; `seconds` cut it short.
  RunReport recorded(Scene& scene, std::string_view name, const std::string& text) {
    const Result<RunReport> report =
        recordRun({&scene, text, libraryFile(name).string(), folder_ / "run.carom"}, {}, nullptr);
    EXPECT_TRUE(report) << report.error().message;
    return report ? *report : RunReport{};
  }

  std::string rendered(const Scene& scene, const Replay& replay) {
    RenderOptions options;
    options.soundFile = folder_ / "sound.wav";
    options.eventsFile = folder_ / "events.csv";
    options.tail = 1.0;
    options.replay = replay;
    const Result<RenderReport> report = renderScene(scene, options);
    EXPECT_TRUE(report) << report.error().message;
    return contents(folder_ / "sound.wav") + contents(folder_ / "events.csv");
  }

  const TemporaryFolder folder_;
};

/// The text of a scene of the library, cut to so many seconds.
std::string shortened(std::string_view name, double seconds) {
  nlohmann::json document = nlohmann::json::parse(contents(libraryFile(name)));
  document["duration"] = seconds;
  return document.dump();
}

TEST_F(RecordedRuns, HaveTheSoundAndTheEventsOfTheirStepperByteForByte) {
  struct Case {
    const char* name;
    double seconds;
  };
  // Blocks that slide and lie on each other, rolling, scraping, ringing, jello with and without.
  for (const auto& [name, seconds] :
       {Case{"wood_blocks", 1.5}, Case{"coin_spin", 0.8}, Case{"marble_rolls_on_wood", 1.0},
        Case{"pen_scrapes_brick", 0.5}, Case{"jello_and_marbles", 0.3}, Case{"jello_drop", 0.7}}) {
    const std::string text = shortened(name, seconds);
    Scene scene = orAbort(parseScene(text, libraryFile(name).string()));
    const std::string stepped = rendered(scene, {});
    recorded(scene, name, text);
    const Result<RecordedRun> run = openRun(folder_ / "run.carom");
    ASSERT_TRUE(run) << run.error().message;
    const Replay replay = [&](double) { return runStepper(run->reader); };
    EXPECT_TRUE(rendered(run->scene, replay) == stepped) << name;
  }
}

TEST_F(RecordedRuns, OfAPartHaveTheSamplesThatTheWholeHasThere) {
  const std::string text = shortened("pen_scrapes_brick", 1.0);
  Scene scene = orAbort(parseScene(text, libraryFile("pen_scrapes_brick").string()));
  recorded(scene, "pen_scrapes_brick", text);
  const auto samplesOf = [&](const SoundSpan& span) {
    const Result<RecordedRun> run = openRun(folder_ / "run.carom");
    RenderOptions options;
    options.soundFile = folder_ / "part.wav";
    options.span = span;
    options.replay = [&](double) { return runStepper(run->reader); };
    EXPECT_TRUE(renderScene(scene, options));
    return readRecording(folder_ / "part.wav").samples;
  };
  const auto whole = samplesOf({});
  const auto part = samplesOf({0.6, 0.9});
  ASSERT_EQ(part.size(), 14'400U * (whole.size() / 48'000U));
  const auto first = static_cast<std::ptrdiff_t>(28'800U * (whole.size() / 48'000U));
  EXPECT_TRUE(std::equal(part.begin(), part.end(), whole.begin() + first));
}

TEST_F(RecordedRuns, HoldPosesOfAllBodiesThatMoveAndPicturesOfTheJello) {
  const std::string text = shortened("jello_and_marbles", 0.2);
  Scene scene = orAbort(parseScene(text, libraryFile("jello_and_marbles").string()));
  const RunReport report = recorded(scene, "jello_and_marbles", text);
  EXPECT_NEAR(static_cast<double>(report.pictures), 0.3 * 60.0, 2.0);  // with 0.1 s after the end
  EXPECT_EQ(report.poses % report.pictures, 0U);
  const Result<RecordedRun> run = openRun(folder_ / "run.carom");
  ASSERT_TRUE(run);
  const auto portions = run->reader->next();
  ASSERT_TRUE(portions && !portions->empty());
  const JelloPicture& first = portions->front().pictures.front();
  const auto& positions = jelloOf(scene)->positions;
  ASSERT_EQ(first.points.size(), 3 * positions.size());
  for (std::size_t point = 0; point < positions.size(); ++point)
    EXPECT_EQ(first.points[3 * point + 1], static_cast<float>(positions[point].y()));
}

TEST_F(RecordedRuns, ThatWereCutOrChangedAreRefused) {
  const std::string text = shortened("wood_blocks", 0.3);
  Scene scene = orAbort(parseScene(text, libraryFile("wood_blocks").string()));
  recorded(scene, "wood_blocks", text);
  expectRefusedIfDamaged(contents(folder_ / "run.carom"));
}

TEST_F(RecordedRuns, ThatAreNotOfTheirSceneAreRefused) {
  RunHeader header{.sceneFile = "s.json",
                   .sceneText = shortened("two_balls", 0.5),
                   .stepper = "bullet",
                   .duration = 0.5,
                   .shape = {.bodies = 99}};
  Result<RunWriter> writer = beginRun(folder_ / "run.carom", header);
  ASSERT_TRUE(writer && writer->finish());
  const Result<RecordedRun> run = openRun(folder_ / "run.carom");
  ASSERT_FALSE(run);
  EXPECT_THAT(run.error().message, HasSubstr("not of the scene"));
}

/// Records of all kinds with numbers that have all their bits.
RunPortion portionOf(unsigned seed, const RunShape& shape) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> number(0.0, 1e3);
  const auto vector = [&] { return Vec3(number(random), number(random), number(random)); };
  const auto turn = [&] {
    return Quat(number(random), number(random), number(random), number(random)).normalized();
  };
  RunPortion portion;
  portion.settledTime = number(random);
  for (std::size_t at = 0; at < seed % 4; ++at) {
    ImpulseEvent event{.time = number(random), .body = 1, .other = 2, .impulse = vector()};
    event.hasOtherPose = at % 2 == 0;
    event.radius = std::abs(number(random));
    event.bodyOrientation = turn();
    event.otherPosition = vector();
    portion.events.push_back(event);
    ContactState contact{.time = number(random), .phase = ContactPhase::end, .body = 2};
    contact.pathEnd = vector();
    contact.otherOrientation = turn();
    portion.contacts.push_back(contact);
    portion.poses.push_back(
        {static_cast<BodyId>(at % shape.bodies), {number(random), vector(), turn()}});
    portion.deformations.push_back({number(random), vector(), vector()});
    portion.pictures.push_back(
        {number(random), std::vector<float>(std::size_t{3} * shape.points, 0.1F)});
  }
  return portion;
}

/// Returns the bytes of the numbers of records; equal for equal bits.
template <class Record>
std::string bitsOf(const std::vector<Record>& records) {
  std::string bits;
  for (const Record& record : records)
    bits.append(reinterpret_cast<const char*>(&record), sizeof record);
  return bits;
}

TEST(RunTables, ComeBackWithTheSameBits) {
  const RunShape shape{.bodies = 3, .points = 5};
  std::vector<RunPortion> portions;
  for (unsigned seed = 0; seed < 12; ++seed)
    portions.push_back(portionOf(seed, shape));
  portions.back().settledTime = std::numeric_limits<double>::infinity();
  const auto read = decodedPortions(encodedPortions(portions), shape);
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->size(), portions.size());
  for (std::size_t at = 0; at < portions.size(); ++at) {
    EXPECT_EQ((*read)[at].settledTime, portions[at].settledTime);
    ASSERT_EQ((*read)[at].events.size(), portions[at].events.size());
    for (std::size_t event = 0; event < portions[at].events.size(); ++event) {
      EXPECT_EQ((*read)[at].events[event].impulse, portions[at].events[event].impulse);
      EXPECT_EQ((*read)[at].events[event].radius, portions[at].events[event].radius);
      EXPECT_EQ((*read)[at].events[event].hasOtherPose, portions[at].events[event].hasOtherPose);
    }
    EXPECT_EQ(bitsOf((*read)[at].deformations), bitsOf(portions[at].deformations));
    EXPECT_EQ((*read)[at].pictures.size(), portions[at].pictures.size());
  }
  // Whatever was not compared above is in the bytes, which are the same again.
  EXPECT_EQ(encodedPortions(*read), encodedPortions(portions));
}

TEST(RunTables, RefuseWhatNoRunHas) {
  const RunShape shape{.bodies = 3, .points = 2};
  const auto refusal = [&](RunPortion portion) {
    const auto read = decodedPortions(encodedPortions(std::vector{std::move(portion)}), shape);
    return read ? std::string("none") : read.error().message;
  };
  RunPortion portion = portionOf(3, shape);
  EXPECT_EQ(refusal(portion), "none");
  RunPortion stranger = portion;
  stranger.events[0].other = 3;
  EXPECT_THAT(refusal(stranger), HasSubstr("a body that the scene has not"));
  RunPortion broken = portion;
  broken.contacts[1].normalLoad = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(refusal(broken), HasSubstr("a number that is none"));
  RunPortion turned = portion;
  turned.poses[0].pose.orientation.coeffs() *= 1e20;
  EXPECT_THAT(refusal(turned), HasSubstr("not of unit length"));
  std::vector<std::byte> bytes = encodedPortions(std::vector{portion});
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{3}, bytes.size() / 2, bytes.size() - 1})
    EXPECT_FALSE(decodedPortions(std::span(bytes).first(size), shape)) << size;
  bytes.push_back(std::byte{0});
  EXPECT_FALSE(decodedPortions(bytes, shape));
  bytes.pop_back();
  bytes[3] = std::byte{0xff};  // rows without end
  EXPECT_FALSE(decodedPortions(bytes, shape));
}

}  // namespace
}  // namespace carom::test
