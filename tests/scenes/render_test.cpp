#include "scenes/run/render.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "scenes/run/scene_sound.h"
#include "tests/scenes/library.h"
#include "tests/support/csv.h"
#include "tests/support/recording.h"
#include "tests/support/temporary_folder.h"

namespace carom::test {

using namespace scenes;

namespace {

namespace fs = std::filesystem;

RenderReport rendered(const Scene& scene, const RenderOptions& options) {
  const Result<RenderReport> report = renderScene(scene, options);
  EXPECT_TRUE(report) << report.error().message;
  return report ? *report : RenderReport{};
}

/// The scenes that these tests render: both steppers, one listener and two, peaks below and above
/// full scale.
std::vector<Scene> variousScenes() {
  return {libraryScene("two_balls"), libraryScene("newtons_cradle"), fewMarbles(),
          onStepper(fewMarbles(), StepperType::bullet), fewRubberBalls()};
}

std::vector<std::vector<std::string>> eventRows(const fs::path& file) {
  std::vector<std::vector<std::string>> rows = parseCsv(contents(file));
  EXPECT_FALSE(rows.empty());
  if (!rows.empty()) rows.erase(rows.begin());
  return rows;
}

Vec3 vectorOf(const std::vector<std::string>& row, std::size_t column) {
  return {numberOf(row[column]), numberOf(row[column + 1]), numberOf(row[column + 2])};
}

/// The sound of one row of the events file: the hand-out's equations (1), (8) and (10) with the
/// numbers of that row and the ball's mass and radius.
struct WrittenClick {
  double time;    // s, first touch
  double tau;     // s
  double speed;   // m/s, the change by the impulse
  double radius;  // m
  Vec3 direction;
  Vec3 centre;

  double pressure(double t, const Vec3& listener) const {
    const Vec3 path = listener - centre;
    const double u = (t - path.norm() / 343.0 - time) / tau - 0.5;
    const double slope = -12.0 * u * std::exp(-6.0 * u * u);  // derivative of exp(-6 u^2)
    const double jerk = std::numbers::pi / 2.0 * speed * slope / (tau * tau);
    const double cosine = direction.dot(path) / path.norm();
    return 1.20 * radius * radius * radius * cosine / (2.0 * 343.0 * path.norm()) * jerk;
  }
};

std::vector<WrittenClick> writtenClicks(const fs::path& file, const Scene& scene) {
  std::map<std::string, const SceneBody*> bodies;
  for (const SceneBody& body : scene.bodies)
    bodies[body.name] = &body;
  std::vector<WrittenClick> clicks;
  for (const std::vector<std::string>& row : eventRows(file)) {
    const auto* ball = std::get_if<SphereShape>(&bodies.at(row[1])->shape);
    if (ball == nullptr) continue;  // walls do not radiate
    const Vec3 impulse = vectorOf(row, 3);
    clicks.push_back({.time = numberOf(row[0]),
                      .tau = numberOf(row[14]),
                      .speed = impulse.norm() / ball->mass,
                      .radius = ball->radius,
                      .direction = impulse.normalized(),
                      .centre = vectorOf(row, 6) + ball->radius * vectorOf(row, 9)});
  }
  return clicks;
}

/// The sum of all clicks at every sample: slow and obvious.
std::vector<double> soundOf(const std::vector<WrittenClick>& clicks, const Vec3& listener,
                            const Recording& recording) {
  std::vector<double> pressure(static_cast<std::size_t>(recording.info.frames), 0.0);
  for (const WrittenClick& click : clicks) {
    const double arrival = click.time + (listener - click.centre).norm() / 343.0;
    const double rate = recording.info.samplerate;
    const double reach = 4.0 * click.tau;
    const auto first = static_cast<std::size_t>(std::max(0.0, (arrival - reach) * rate));
    const auto end = static_cast<std::size_t>((arrival + reach) * rate);
    for (std::size_t sample = first; sample < std::min(end, pressure.size()); ++sample)
      pressure[sample] += click.pressure(static_cast<double>(sample) / rate, listener);
  }
  return pressure;
}

TEST(Render, SoundIsTheSumOfTheClicksInTheEventsFile) {
  for (const Scene& any : variousScenes()) {
    const Scene scene = asInTheHandOut(any);
    const TemporaryFolder folder;
    const RenderReport report =
        rendered(scene, {.soundFile = folder / "sound.wav", .eventsFile = folder / "events.csv"});
    const std::vector<WrittenClick> clicks = writtenClicks(folder / "events.csv", scene);
    ASSERT_FALSE(clicks.empty());
    const Recording recording = readRecording(folder / "sound.wav");
    ASSERT_EQ(recording.channels(), scene.listeners.size());
    for (std::size_t channel = 0; channel < scene.listeners.size(); ++channel) {
      const std::vector<double> expected =
          soundOf(clicks, scene.listeners[channel].position, recording);
      const std::vector<double> samples = recording.channel(channel);
      double largest = 0.0;  // Pa
      for (std::size_t sample = 0; sample < samples.size(); ++sample)
        largest = std::max(largest, std::abs(20.0 * samples[sample] - expected[sample]));
      // Samples are rounded to float twice, and each click that was left out is below 20 uPa.
      const double rounding = 2.0 * std::numeric_limits<float>::epsilon() * report.peak;
      EXPECT_LT(largest, rounding + 20e-6 * static_cast<double>(report.synth.inaudible))
          << scene.name << ", channel " << channel;
    }
  }
}

TEST(Render, ReportCountsTheRowsOfTheEventsFile) {
  for (const Scene& scene : variousScenes()) {
    const TemporaryFolder folder;
    const RenderReport report =
        rendered(scene, {.soundFile = folder / "sound.wav", .eventsFile = folder / "events.csv"});
    EXPECT_GT(report.events, 0u);
    EXPECT_EQ(report.events, eventRows(folder / "events.csv").size());
  }
}

TEST(Render, BothSharesOfEachCollisionAreWrittenAndOpposite) {
  for (const Scene& scene : variousScenes()) {
    const TemporaryFolder folder;
    rendered(scene, {.soundFile = folder / "sound.wav", .eventsFile = folder / "events.csv"});
    const auto rows = eventRows(folder / "events.csv");
    ASSERT_EQ(rows.size() % 2, 0u);
    for (std::size_t row = 0; row < rows.size(); row += 2) {
      const auto& share = rows[row];
      const auto& other = rows[row + 1];
      EXPECT_EQ(share[1], other[2]);
      EXPECT_EQ(share[2], other[1]);
      for (const std::size_t same : {0U, 6U, 7U, 8U, 12U, 13U, 14U})
        EXPECT_EQ(share[same], other[same]);
      EXPECT_EQ(vectorOf(share, 3), -vectorOf(other, 3));
      EXPECT_EQ(vectorOf(share, 9), -vectorOf(other, 9));
      EXPECT_GT(vectorOf(share, 3).dot(vectorOf(share, 9)), 0.0);  // contacts push, never pull
    }
  }
}

TEST(Render, EventsAreInOrderOfTimeAndWithinTheScene) {
  for (const Scene& scene : variousScenes()) {
    const TemporaryFolder folder;
    rendered(scene, {.soundFile = folder / "sound.wav", .eventsFile = folder / "events.csv"});
    double time = 0.0;
    for (const auto& row : eventRows(folder / "events.csv")) {
      EXPECT_GE(numberOf(row[0]), time);
      time = numberOf(row[0]);
    }
    EXPECT_LE(time, scene.duration);
  }
}

TEST(Render, FileHasTheLengthTheRateAndOneChannelPerListener) {
  Scene scene = libraryScene("two_balls");
  scene.duration = 0.43215;
  scene.sampleRate = 44100.0;
  scene.listeners.push_back({"second", {0.0, 2.0, 0.0}});
  scene.listeners.push_back({"third", {0.0, 0.0, 3.0}});
  const TemporaryFolder folder;
  const RenderReport report = rendered(scene, {.soundFile = folder / "sound.wav"});
  const Recording recording = readRecording(folder / "sound.wav");
  EXPECT_EQ(recording.info.frames, 19058);  // 19057.8 samples
  EXPECT_EQ(recording.info.samplerate, 44100);
  EXPECT_EQ(recording.info.channels, 3);
  EXPECT_DOUBLE_EQ(report.duration, 19058.0 / 44100.0);
  EXPECT_EQ(report.sampleRate, 44100.0);
  EXPECT_EQ(report.channels, 3u);
}

TEST(Render, EachListenerHasTheChannelOfItsPlaceInTheList) {
  Scene scene = fewMarbles();
  const TemporaryFolder folder;
  rendered(scene, {.soundFile = folder / "there.wav"});
  std::swap(scene.listeners[0], scene.listeners[1]);
  rendered(scene, {.soundFile = folder / "swapped.wav"});
  const Recording there = readRecording(folder / "there.wav");
  const Recording swapped = readRecording(folder / "swapped.wav");
  EXPECT_EQ(there.channel(0), swapped.channel(1));
  EXPECT_EQ(there.channel(1), swapped.channel(0));
  EXPECT_NE(there.channel(0), there.channel(1));
}

TEST(Render, PeakIsTheFilesPeakTimes20Pa) {
  for (const Scene& scene : variousScenes()) {
    const TemporaryFolder folder;
    const RenderReport report = rendered(scene, {.soundFile = folder / "sound.wav"});
    EXPECT_GT(report.peak, 0.0);
    EXPECT_NEAR(readRecording(folder / "sound.wav").peak() * 20.0 / report.peak, 1.0, 1e-7);
  }
}

TEST(Render, NormalizeScalesTheFileToOneAndNothingElse) {
  for (const Scene& scene : variousScenes()) {
    const TemporaryFolder folder;
    const RenderReport plain =
        rendered(scene, {.soundFile = folder / "plain.wav", .eventsFile = folder / "plain.csv"});
    const RenderReport scaled = rendered(scene, {.soundFile = folder / "scaled.wav",
                                                 .normalize = true,
                                                 .eventsFile = folder / "scaled.csv"});
    EXPECT_EQ(scaled.peak, plain.peak);  // still in pascals
    EXPECT_EQ(contents(folder / "scaled.csv"), contents(folder / "plain.csv"));
    const Recording loud = readRecording(folder / "scaled.wav");
    const Recording quiet = readRecording(folder / "plain.wav");
    EXPECT_EQ(loud.peak(), 1.0);
    ASSERT_EQ(loud.samples.size(), quiet.samples.size());
    const double gain = 20.0 / plain.peak;
    double largest = 0.0;
    for (std::size_t sample = 0; sample < loud.samples.size(); ++sample)
      largest = std::max(largest, std::abs(loud.samples[sample] - gain * quiet.samples[sample]));
    EXPECT_LT(largest, 2.0 * std::numeric_limits<float>::epsilon());
  }
}

TEST(Render, FullScaleOnlyScalesTheFile) {
  const Scene scene = libraryScene("two_balls");
  const TemporaryFolder folder;
  const RenderReport plain = rendered(scene, {.soundFile = folder / "plain.wav"});
  const RenderReport scaled =
      rendered(scene, {.soundFile = folder / "scaled.wav", .fullScale = 80.0});
  EXPECT_EQ(plain.fullScale, 20.0);
  EXPECT_EQ(scaled.fullScale, 80.0);
  EXPECT_EQ(scaled.peak, plain.peak);
  std::vector<double> quarter = readRecording(folder / "plain.wav").samples;
  for (double& sample : quarter)
    sample /= 4.0;
  EXPECT_EQ(readRecording(folder / "scaled.wav").samples, quarter);
}

TEST(Render, LimitingIsTheDefaultOfPcm16AndLeavesTheRestOfTheSoundInItsPlace) {
  const Scene scene = libraryScene("two_balls");  // 31 Pa at the listener
  const TemporaryFolder folder;
  const RenderReport plain = rendered(scene, {.soundFile = folder / "plain.wav"});
  const RenderReport limited =
      rendered(scene, {.soundFile = folder / "limited.wav", .limit = true});
  const RenderReport narrow =
      rendered(scene, {.soundFile = folder / "short.wav", .format = SampleFormat::pcm16});
  EXPECT_FALSE(plain.limiter);
  EXPECT_EQ(plain.gainReduction, 0.0);
  for (const RenderReport& report : {limited, narrow}) {
    EXPECT_TRUE(report.limiter);
    EXPECT_EQ(report.clippedSamples, 0u);
    EXPECT_EQ(report.peak, plain.peak);
    EXPECT_NEAR(report.gainReduction, 20.0 * std::log10(plain.peak / 20.0), 1e-4);
  }
  const std::vector<double> before = readRecording(folder / "plain.wav").samples;
  const std::vector<double> after = readRecording(folder / "limited.wav").samples;
  const std::vector<double> rounded = readRecording(folder / "short.wav").samples;
  ASSERT_EQ(after.size(), before.size());
  ASSERT_EQ(rounded.size(), before.size());
  const double least = 20.0 / plain.peak;
  for (std::size_t sample = 0; sample < before.size(); ++sample) {
    EXPECT_LE(std::abs(after[sample]), 1.0);
    EXPECT_NEAR(rounded[sample], after[sample], 1.0001 / 32768.0);  // PCM16 cannot hold 1.0
    if (before[sample] == 0.0) continue;
    EXPECT_GE(after[sample] / before[sample], least * (1.0 - 1e-6));  // a gain without a shift
    EXPECT_LE(after[sample] / before[sample], 1.0);
  }
  EXPECT_NEAR(readRecording(folder / "limited.wav").peak(), 1.0, 1e-6);
}

TEST(Render, Pcm16ClipsWhatExceedsFullScaleAndCountsIt) {
  const Scene scene = libraryScene("two_balls");  // 31 Pa at the listener
  const TemporaryFolder folder;
  const RenderReport wide = rendered(scene, {.soundFile = folder / "float.wav"});
  const RenderReport narrow = rendered(
      scene, {.soundFile = folder / "short.wav", .format = SampleFormat::pcm16, .limit = false});
  const Recording whole = readRecording(folder / "float.wav");
  const Recording clipped = readRecording(folder / "short.wav");
  ASSERT_EQ(whole.samples.size(), clipped.samples.size());
  std::uint64_t beyond = 0;
  for (std::size_t sample = 0; sample < whole.samples.size(); ++sample) {
    if (std::abs(whole.samples[sample]) > 1.0) ++beyond;
    const double expected = std::clamp(whole.samples[sample], -1.0, 1.0 - 1.0 / 32768.0);
    EXPECT_NEAR(clipped.samples[sample], expected, 0.5001 / 32768.0);
  }
  EXPECT_GT(beyond, 0u);
  EXPECT_EQ(narrow.clippedSamples, beyond);
  EXPECT_EQ(wide.clippedSamples, 0u);
  EXPECT_EQ(narrow.peak, wide.peak);
}

TEST(Render, SameSceneGivesTheSameBytes) {
  for (const Scene& scene : variousScenes()) {
    const TemporaryFolder folder;
    for (const std::string run : {"one", "two"}) {
      rendered(scene,
               {.soundFile = folder / (run + ".wav"), .eventsFile = folder / (run + ".csv")});
    }
    EXPECT_EQ(contents(folder / "one.wav"), contents(folder / "two.wav")) << scene.name;
    EXPECT_EQ(contents(folder / "one.csv"), contents(folder / "two.csv")) << scene.name;
  }
}

struct Pieces {
  std::vector<std::vector<float>> channels;
  std::vector<ImpulseEvent> events;
};

Pieces renderedInBlocksOf(std::size_t frames, const Scene& scene) {
  Result<SceneSound> sound = SceneSound::create(scene);
  EXPECT_TRUE(sound);
  Pieces pieces;
  pieces.channels.resize(scene.listeners.size());
  std::vector<std::vector<float>> block(scene.listeners.size(), std::vector<float>(frames));
  while (const std::size_t count = sound->render(block)) {
    for (std::size_t channel = 0; channel < block.size(); ++channel) {
      pieces.channels[channel].insert(pieces.channels[channel].end(), block[channel].begin(),
                                      block[channel].begin() + static_cast<std::ptrdiff_t>(count));
    }
    for (const auto& [event, peak] : sound->settledEvents())
      pieces.events.push_back(event);
  }
  return pieces;
}

TEST(Render, PeaksInTheEventsFileBoundTheSoundAndTellWhatIsHeard) {
  const TemporaryFolder folder;
  const Scene scene = libraryScene("two_balls");
  const auto peaksOf = [&](double threshold, std::vector<std::string>& heard) {
    Scene changed = scene;
    changed.sound.audibleThreshold = threshold;
    const RenderReport report =
        rendered(changed, {.soundFile = folder / "sound.wav", .eventsFile = folder / "events.csv"});
    double sum = 0.0;
    heard.clear();
    for (const auto& row : eventRows(folder / "events.csv")) {
      EXPECT_EQ(row.at(15), "1");  // both shares of the one collision
      sum += numberOf(row.at(16));
      heard.push_back(row.at(17));
    }
    EXPECT_LE(report.peak, sum);
    EXPECT_EQ(report.peak > 0.0, heard.front() == "1");
    return std::pair{report.peak, sum};
  };
  std::vector<std::string> heard;
  const auto [peak, bound] = peaksOf(2e-5, heard);
  EXPECT_EQ(heard, (std::vector<std::string>{"1", "1"}));
  EXPECT_GT(peak, 0.2 * bound);  // the two clicks may cancel in part
  EXPECT_EQ(peaksOf(2.0 * bound, heard).second, bound);
  EXPECT_EQ(heard, (std::vector<std::string>{"0", "0"}));
}

TEST(Render, BlockSizeDoesNotMatter) {
  for (const Scene& scene :
       {onStepper(fewMarbles(), StepperType::native), onStepper(fewMarbles(), StepperType::bullet),
        onStepper(fewMarbles(), StepperType::bullet, 1.0 / 60.0), fewRubberBalls()}) {
    const Pieces whole = renderedInBlocksOf(100'000, scene);
    ASSERT_FALSE(whole.events.empty());
    for (const std::size_t frames : {1U, 7U, 480U, 4096U}) {
      const Pieces pieces = renderedInBlocksOf(frames, scene);
      EXPECT_EQ(pieces.channels, whole.channels) << frames;
      ASSERT_EQ(pieces.events.size(), whole.events.size()) << frames;
      for (std::size_t event = 0; event < whole.events.size(); ++event) {
        EXPECT_EQ(pieces.events[event].time, whole.events[event].time);
        EXPECT_EQ(pieces.events[event].impulse, whole.events[event].impulse);
      }
    }
  }
}

TEST(Render, TellsItsProgressFromStartToEnd) {
  const TemporaryFolder folder;
  std::vector<double> shares;
  rendered(fewMarbles(), {.soundFile = folder / "sound.wav",
                          .progress = [&](double share) { shares.push_back(share); }});
  ASSERT_GT(shares.size(), 1u);
  EXPECT_GT(shares.front(), 0.0);
  EXPECT_TRUE(std::ranges::is_sorted(shares));
  EXPECT_EQ(shares.back(), 1.0);
}

/// The plan's reason for leaving the stage out; empty if it was not left out.
std::string whyLeftOut(const RenderReport& report, const std::string& stage) {
  const auto entry = std::ranges::find(report.plan.leftOut, stage, &LeftOut::stage);
  return entry == report.plan.leftOut.end() ? std::string() : entry->why;
}

TEST(Render, PlanSaysHowManyClicksCouldNotBeHeard) {
  Scene scene = libraryScene("newtons_cradle");
  const auto inaudible = [&] {
    const TemporaryFolder folder;
    const RenderReport report = rendered(scene, {.soundFile = folder / "sound.wav"});
    EXPECT_EQ(report.peak == 0.0, report.synth.inaudible == report.synth.events);
    return whyLeftOut(report, "inaudible_clicks");
  };
  EXPECT_EQ(inaudible(), "");
  scene.listeners[0].position *= 1e6;  // 700 km away
  scene.duration = 1.0;
  EXPECT_TRUE(inaudible().starts_with("10 clicks "));
}

TEST(Render, PlanSaysHowManySpheresWereCrushed) {
  Scene scene = libraryScene("bouncing_ball");
  const auto jammed = [&] {
    const TemporaryFolder folder;
    return whyLeftOut(rendered(scene, {.soundFile = folder / "sound.wav"}), "jammed_spheres");
  };
  scene.duration = 1.0;
  EXPECT_EQ(jammed(), "");
  scene.bodies.push_back(scene.bodies[0]);
  SceneBody& press = scene.bodies.back();
  press.name = "press";
  press.shape = PlaneShape{-Vec3::UnitY(), -0.6, {0.0, -1.0, 0.0}, {}};  // down to the floor
  EXPECT_TRUE(jammed().starts_with("1 spheres "));
}

/// A render that cannot succeed, in a folder that holds a file of each kind beforehand.
class FailedRender : public testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(sound_) << "old sound";
    std::ofstream(events_) << "old events";
    fs::create_directory(folder_ / "directory");
    ASSERT_EQ(mkfifo((folder_ / "fifo").c_str(), 0600), 0);
  }

  void expectFailure(const RenderOptions& options) {
    const Result<RenderReport> report = renderScene(libraryScene("two_balls"), options);
    ASSERT_FALSE(report);
    EXPECT_FALSE(report.error().message.empty());
    EXPECT_EQ(contents(sound_), "old sound");
    EXPECT_EQ(contents(events_), "old events");
    EXPECT_TRUE(fs::is_empty(folder_ / "directory"));
    EXPECT_TRUE(fs::is_fifo(folder_ / "fifo"));
    EXPECT_EQ(folder_.entries(), 4u) << report.error().message;
  }

  std::vector<fs::path> badTargets() const {
    return {folder_ / "nowhere" / "file",
            folder_ / "directory",
            folder_ / "fifo",
            folder_.path() / "",
            fs::path(),
            fs::path("/proc/file")};
  }

  TemporaryFolder folder_;
  fs::path sound_ = folder_ / "sound.wav";
  fs::path events_ = folder_ / "events.csv";
};

TEST_F(FailedRender, LeavesNothingBehindWhereTheSoundCannotBeWritten) {
  for (const fs::path& target : badTargets()) {
    expectFailure({.soundFile = target});
    expectFailure({.soundFile = target, .normalize = true, .eventsFile = events_});
  }
}

TEST_F(FailedRender, LeavesNothingBehindWhereTheEventsCannotBeWritten) {
  for (const fs::path& target : badTargets())
    expectFailure({.soundFile = sound_, .eventsFile = target});
}

TEST_F(FailedRender, RefusesOneNameForSoundAndEvents) {
  expectFailure({.soundFile = sound_, .eventsFile = sound_});
  expectFailure({.soundFile = sound_, .eventsFile = folder_ / "directory/../sound.wav"});
}

TEST_F(FailedRender, LeavesNothingBehindWhereTheSceneCannotBeRun) {
  Scene scene = libraryScene("two_balls");
  scene.medium.speedOfSound = 0.0;
  EXPECT_FALSE(renderScene(scene, {.soundFile = folder_ / "new.wav"}));
  EXPECT_EQ(folder_.entries(), 4u);
}

}  // namespace
}  // namespace carom::test
