// Each share of a collision has one fate in the counters, whatever a host does; and what a host
// says that cannot be costs its own instant.

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "carom/event_sound.h"
#include "tests/audio/ball_drop.h"
#include "tests/audio/ringing_box.h"
#include "tests/support/full_disk.h"
#include "tests/support/random.h"
#include "tests/support/recording.h"
#include "tests/support/sanitizers.h"
#include "tests/support/temporary_folder.h"

namespace carom {
namespace {

using test::BallDrop;
using test::TemporaryFolder;

constexpr double kFateRate = 48000.0;
constexpr BodyId kFateBall = 1;
constexpr BodyId kFateBox = 2;
constexpr BodyId kFateStone = 3;
constexpr BodyId kFateBell = 4;  // only rings
constexpr BodyId kFateSoft = 5;  // touches for long

SoundSettings fateSettings(SoundClock clock = SoundClock::simulation) {
  SoundSettings settings;
  settings.clock = clock;
  settings.listeners = {{"near", {0.0, 0.2, 0.3}}};
  settings.fullScale = 1.0;
  settings.onMessage = [](const std::string&) {};
  return settings;
}

BallDrop softBall(double time = 0.0) {
  return {.material = *findMaterial("rubber"), .radius = 0.02, .time = time};
}

EventSound fateSound(const SoundSettings& settings) {
  Result<EventSound> sound = EventSound::create(settings);
  EXPECT_TRUE(sound) << sound.error().message;
  SoundBody bell = BallDrop{}.floor();
  bell.modal = test::boxOf({{700.0, 8.0}, {2100.0, 30.0}});
  SoundBody box = bell;
  box.mass = 0.04;
  box.radius = 0.02;
  EXPECT_TRUE(sound->setBody(kFateBall, test::dropOnBox(0.0).ball()));
  EXPECT_TRUE(sound->setBody(kFateBox, box));
  EXPECT_TRUE(sound->setBody(kFateSoft, softBall().ball()));
  EXPECT_TRUE(sound->setBody(kFateStone, BallDrop{}.floor()));
  EXPECT_TRUE(sound->setBody(kFateBell, bell));
  return *std::move(sound);
}

ImpulseEvent ballOn(BodyId other, double time) {
  ImpulseEvent event = test::dropOnBox(time).event();
  event.body = kFateBall;
  event.other = other;
  return event;
}

ImpulseEvent hit(BodyId body, double time) {
  ImpulseEvent event = test::floorShare(test::dropOnBox(time));
  event.body = body;
  event.other = kFateBall;
  return event;
}

std::uint64_t fatesOf(const SoundStatistics& s) {
  return s.silenced + s.skipped + s.immovable + s.rejected + s.heard + s.inaudible + s.masked +
         s.stolen + s.overBudget + s.noBus + s.tooLong + s.ringsLeftOut + s.queueFaults + s.lost +
         s.waiting;
}

std::uint64_t reasonsOf(const SoundStatistics& s) {
  return s.rejectedNotFinite + s.rejectedUnknownBody + s.rejectedNoContact + s.rejectedTooLong +
         s.rejectedTooFar;
}

std::vector<float> pull(EventSound& sound, std::size_t frames) {
  std::vector<float> samples(frames);
  float* const channel = samples.data();
  sound.render(std::span(&channel, 1), frames);
  return samples;
}

TEST(Fates, EachEventThatIsGoodIsHeard) {
  EventSound sound = fateSound(fateSettings());
  ASSERT_TRUE(sound.prepareRendering(kFateRate));
  for (int i = 0; i < 100; ++i) {
    sound.post(ballOn(kFateBox, 0.01 * i));
    sound.post(hit(kFateBox, 0.01 * i));
    sound.post(ballOn(kFateBell, 0.01 * i + 0.005));
    sound.post(hit(kFateBell, 0.01 * i + 0.005));
    sound.post(hit(kFateStone, 0.01 * i + 0.005));
    sound.advanceTo(0.01 * (i + 1));
    pull(sound, 480);
  }
  EXPECT_EQ(sound.statistics().posted, 500u);
  pull(sound, 4800);
  const SoundStatistics told = sound.statistics();
  EXPECT_EQ(told.heard, 400u);
  EXPECT_EQ(told.immovable, 100u);
  EXPECT_EQ(told.waiting, 0u);
  EXPECT_EQ(fatesOf(told), 500u);
}

TEST(Fates, OfWhatNobodyHearsIsThatItIsSkipped) {
  EventSound sound = fateSound(fateSettings());
  sound.post(ballOn(kFateBox, 0.01));
  EXPECT_EQ(sound.statistics().posted, 1u);
  EXPECT_EQ(sound.statistics().skipped, 1u);
}

TEST(Fates, OfWhatWaitsWhenItsOutputEndsIsThatItIsLost) {
  EventSound sound = fateSound(fateSettings());
  ASSERT_TRUE(sound.prepareRendering(kFateRate));
  sound.post(ballOn(kFateBox, 0.01));
  sound.advanceTo(0.02);
  pull(sound, 4800);
  sound.post(ballOn(kFateBox, 0.2));
  sound.post(hit(kFateBell, 0.2));
  sound.advanceTo(0.21);
  sound.post(ballOn(kFateBox, 0.22));  // not yet sent off
  EXPECT_EQ(sound.statistics().waiting, 3u);
  ASSERT_TRUE(sound.prepareRendering(44100.0));
  EXPECT_EQ(sound.statistics().waiting, 0u);
  EXPECT_EQ(sound.statistics().lost, 3u);
  EXPECT_EQ(sound.statistics().heard, 1u);
  EXPECT_EQ(sound.statistics().posted, 4u);
}

// The counters of a recording stay what they are when samples are pulled as well, and after.
TEST(Fates, AreThoseOfOneOutputWhereThereAreTwo) {
  const TemporaryFolder folder;
  EventSound sound = fateSound(fateSettings());
  ASSERT_TRUE(sound.record(folder / "a.wav"));
  for (int i = 1; i <= 10; ++i) {
    sound.post(ballOn(kFateBox, 0.1 * i));
    sound.advanceTo(0.1 * i + 0.01);
    if (i == 3) {
      EXPECT_TRUE(sound.prepareRendering(kFateRate));
    }
    if (i == 7) sound.stop();
    if (i > 3) pull(sound, 4800);
    EXPECT_EQ(sound.statistics().posted, static_cast<std::uint64_t>(i));
    EXPECT_GE(sound.statistics().events, static_cast<std::uint64_t>(i));
  }
  ASSERT_TRUE(sound.close());
  const SoundStatistics told = sound.statistics();
  EXPECT_EQ(told.events, 10u);
  EXPECT_EQ(fatesOf(told), 10u);
  EXPECT_EQ(told.waiting, 0u);
}

/// A host that posts good and bad events in random order, in random outputs, on a clock that leaps.
class FateHost {
 public:
  FateHost(std::uint64_t seed, const TemporaryFolder& folder)
      : random_(seed), sound_(fateSound(settingsOf(random_))), folder_(folder) {}

  void turn() {
    const int choice = random_.below(100);
    if (choice < 60) {
      postSome();
    } else if (choice < 85) {
      step();
    } else if (choice < 90) {
      pull(sound_, static_cast<std::size_t>(random_.below(5000)));
    } else if (choice < 92) {
      (void)sound_.prepareRendering(random_.chance(0.5) ? 48000.0 : 44100.0);
    } else if (choice < 94) {
      sound_.stop();
    } else if (choice < 96) {
      (void)sound_.record(folder_ / "host.wav");
    } else if (choice < 97) {
      (void)sound_.finishRecording();
    } else if (choice < 98) {
      sound_.removeBody(kFateBox);
    } else {
      sound_.pause();
    }
    const SoundStatistics told = sound_.statistics();
    ASSERT_EQ(told.posted, posted_);
    ASSERT_EQ(fatesOf(told), posted_);
    ASSERT_EQ(reasonsOf(told), told.rejected);
    ASSERT_LE(told.waiting, posted_);
  }

  SoundStatistics end() {
    EXPECT_TRUE(sound_.close());
    return sound_.statistics();
  }
  std::uint64_t posted() const { return posted_; }

 private:
  static SoundSettings settingsOf(Random& random) {
    const bool isReal = random.chance(0.5);
    SoundSettings settings = fateSettings(isReal ? SoundClock::realTime : SoundClock::simulation);
    settings.budget.voices = random.chance(0.5) ? 4 : 2048;
    settings.budget.buses = random.chance(0.3) ? 1 : 64;
    settings.budget.ringingBodies = random.chance(0.5) ? 1 : 16;
    settings.budget.longestContact = random.chance(0.2) ? 1e-5 : 0.05;
    settings.synth.audibleThreshold = random.chance(0.3) ? 0.05 : 20e-6;
    if (random.chance(0.3)) settings.synth.lasting = LastingDetail::exact;
    return settings;
  }

  ImpulseEvent someEvent() {
    const double time = time_ + random_.between(-0.05, 0.05);
    if (random_.chance(0.1)) {
      ImpulseEvent soft = softBall(time).event();
      soft.body = kFateSoft;
      soft.other = kFateStone;
      return soft;
    }
    const BodyId partners[] = {kFateBox, kFateStone, kFateBell};
    const BodyId partner = partners[random_.below(3)];
    ImpulseEvent event = random_.chance(0.5) ? ballOn(partner, time) : hit(partner, time);
    event.impulse *= random_.logBetween(1e-6, 1.0);
    const double bad[] = {std::nan(""), HUGE_VAL, 1e20, 1e45, 1e300, 0.0, -1.0};
    const double number = bad[random_.below(7)];
    switch (random_.below(30)) {
      case 0:
        event.time = number;
        break;
      case 1:
        event.impulse *= number;
        break;
      case 2:
        event.bodyOrientation.coeffs() *= number;
        break;
      case 3:
        event.effectiveMass = number;
        break;
      case 4:
        event.approachSpeed = number;
        break;
      case 5:
        event.radius = number;
        break;
      case 6:
        event.position *= number;
        break;
      case 7:
        event.bodyVelocity *= number;
        break;
      case 8:
        event.body = 99;
        break;
      default:
        break;
    }
    return event;
  }

  void postSome() {
    for (int count = random_.below(6); count >= 0; --count) {
      sound_.post(someEvent());
      ++posted_;
    }
  }

  void step() {
    time_ += random_.between(0.0, 0.03);
    if (random_.chance(0.05)) time_ += random_.between(-2.0, 2.0);
    if (random_.chance(0.02)) time_ += random_.between(-200.0, 200.0);
    sound_.advanceTo(random_.chance(0.02) ? std::nan("") : time_);
  }

  Random random_;
  EventSound sound_;
  const TemporaryFolder& folder_;
  double time_ = 0.0;
  std::uint64_t posted_ = 0;
};

TEST(Fates, AddUpWhateverAHostDoes) {
  SoundStatistics all;
  for (std::uint64_t seed = 0; seed < (kSanitized ? 8 : 20); ++seed) {
    SCOPED_TRACE(seed);
    const TemporaryFolder folder;
    FateHost host(seed, folder);
    for (int turn = 0; turn < 300; ++turn) {
      host.turn();
      if (testing::Test::HasFatalFailure()) return;
    }
    const SoundStatistics told = host.end();
    EXPECT_EQ(fatesOf(told), host.posted());
    EXPECT_EQ(told.waiting, 0u);
    EXPECT_EQ(told.silencedFrames, 0u);
    static_cast<SynthCounters&>(all) += told;
    all.skipped += told.skipped;
    all.queueFaults += told.queueFaults;
  }
  // Each fate has come up, or the test would say nothing of it.
  EXPECT_GT(all.skipped, 0u);
  EXPECT_GT(all.immovable, 0u);
  EXPECT_GT(all.rejectedNotFinite, 0u);
  EXPECT_GT(all.rejectedUnknownBody, 0u);
  EXPECT_GT(all.rejectedNoContact, 0u);
  EXPECT_GT(all.rejectedTooFar, 0u);
  EXPECT_GT(all.heard, 0u);
  EXPECT_GT(all.inaudible, 0u);
  EXPECT_GT(all.stolen, 0u);
  EXPECT_GT(all.noBus, 0u);
  EXPECT_GT(all.tooLong, 0u);
  EXPECT_GT(all.ringsLeftOut, 0u);
  EXPECT_GT(all.lost, 0u);
}

// ---- Huge events and leaps of the clock

/// Renders three impacts, of which the host spoils the middle one.
template <class Spoil>
std::vector<float> spoiled(const Spoil& spoil, SoundStatistics& told) {
  SoundSettings settings = fateSettings();
  settings.limiter.emplace();
  EventSound sound = fateSound(settings);
  EXPECT_TRUE(sound.prepareRendering(kFateRate));
  std::vector<float> heard;
  for (int i = 0; i < 30; ++i) {
    if (i % 10 == 5) {
      ImpulseEvent event = hit(kFateBox, 0.01 * i + 0.005);
      if (i == 15) spoil(event);
      sound.post(event);
    }
    sound.advanceTo(0.01 * (i + 1));
    const std::vector<float> block = pull(sound, sound.framesReady());
    heard.insert(heard.end(), block.begin(), block.end());
  }
  told = sound.statistics();
  return heard;
}

TEST(Fates, OfAHugeEventIsThatItIsRejectedAndNothingElseChanges) {
  SoundStatistics told;
  const std::vector<float> right =
      spoiled([](ImpulseEvent& event) { event.body = 99; }, told);  // rejected, too
  const auto expectSame = [&](const auto& spoil, std::uint64_t SynthCounters::*reason) {
    EXPECT_TRUE(spoiled(spoil, told) == right);
    EXPECT_EQ(told.rejected, 1u);
    EXPECT_EQ(told.*reason, 1u);
  };
  expectSame([](ImpulseEvent& event) { event.impulse *= 1e45; }, &SynthCounters::rejectedTooFar);
  expectSame([](ImpulseEvent& event) { event.bodyOrientation.coeffs() *= 1e20; },
             &SynthCounters::rejectedNotFinite);
  expectSame([](ImpulseEvent& event) { event.time = std::nan(""); },
             &SynthCounters::rejectedNotFinite);
  expectSame([](ImpulseEvent& event) { event.time = -HUGE_VAL; },
             &SynthCounters::rejectedNotFinite);
}

/// Frames of a recording where its sound exceeds a tenth of its peak, after quiet.
std::vector<std::size_t> onsetsOf(const test::Recording& recording) {
  std::vector<std::size_t> onsets;
  const double loud = 0.1 * recording.peak();
  for (std::size_t frame = 0; frame < recording.samples.size(); ++frame)
    if (std::abs(recording.samples[frame]) > loud &&
        (onsets.empty() || frame > onsets.back() + 1000))
      onsets.push_back(frame);
  return onsets;
}

// Two impacts, 30 ms before and 50 ms after a leap, which would be 80 ms apart without it.
TEST(Fates, OfWhatIsPendingAtALeapIsThatItIsHeard) {
  for (const double to : {5000.0, 0.3, 0.9, -200.0}) {
    for (const bool isPostedBefore : {true, false}) {
      SCOPED_TRACE(to);
      const TemporaryFolder folder;
      EventSound sound = fateSound(fateSettings());
      ASSERT_TRUE(sound.record(folder / "leap.wav"));
      sound.advanceTo(0.95);
      sound.post(ballOn(kFateStone, 0.97));
      if (isPostedBefore) sound.advanceTo(1.0);
      // Of a leap that only the step tells, the event before it is known by its time.
      sound.advanceTo(to);
      sound.post(ballOn(kFateStone, to + 0.05));
      sound.advanceTo(to + 0.1);
      ASSERT_TRUE(sound.finishRecording());
      EXPECT_EQ(sound.statistics().heard, 2u);
      EXPECT_EQ(sound.statistics().lost, 0u);
      EXPECT_EQ(sound.statistics().jumps, 1u);
      const std::vector<std::size_t> onsets = onsetsOf(test::readRecording(folder / "leap.wav"));
      ASSERT_EQ(onsets.size(), 2u);
      EXPECT_NEAR(static_cast<double>(onsets[0]), 0.97 * kFateRate, 100.0);
      const double apart = isPostedBefore ? 0.08 : 0.03;
      EXPECT_NEAR(static_cast<double>(onsets[1] - onsets[0]), apart * kFateRate, 2.0);
    }
  }
}

TEST(Fates, OfWhatIsPostedBeforeTheClockGoesBackIsThatItIsHeardNow) {
  EventSound sound = fateSound(fateSettings(SoundClock::realTime));
  ASSERT_TRUE(sound.prepareRendering(kFateRate));
  pull(sound, 480);
  for (int i = 0; i < 100; ++i) {
    sound.advanceTo(100.0 + 0.01 * i);
    pull(sound, 480);
  }
  sound.post(ballOn(kFateStone, 100.995));
  sound.advanceTo(0.0);
  double peak = 0.0;
  for (const float sample : pull(sound, 9600))
    peak = std::max(peak, std::abs(static_cast<double>(sample)));
  EXPECT_GT(peak, 0.0);
  EXPECT_EQ(sound.statistics().jumps, 1u);
  EXPECT_EQ(sound.statistics().heard, 1u);
}

// ---- Recordings that end by an error

TEST(Fates, OfARecordingOnAFullDiskIsThatItIsKeptAndToldAtOnce) {
  const TemporaryFolder folder;
  std::vector<std::string> told;
  SoundSettings settings = fateSettings();
  settings.fullScale.reset();  // an automatic level, as is the default
  settings.onMessage = [&told](const std::string& sentence) { told.push_back(sentence); };
  EventSound sound = fateSound(settings);
  ASSERT_TRUE(sound.record(folder / "full.wav"));
  const test::FullDisk disk(200'000);  // a second
  for (int i = 1; i <= 20; ++i) {
    sound.post(ballOn(kFateStone, 0.1 * i - 0.05));
    sound.advanceTo(0.1 * i);
    const bool isFull = 0.1 * i - settings.latency > 200'000.0 / 4.0 / kFateRate;
    EXPECT_EQ(told.size(), isFull ? 1u : 0u) << i;
    EXPECT_EQ(sound.statistics().recordingError.empty(), !isFull) << i;
  }
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(sound.statistics().recordingError, told[0]);
  EXPECT_NE(told[0].find("File too large; the 1.04"), std::string::npos) << told[0];
  const Status finished = sound.finishRecording();
  ASSERT_FALSE(finished);
  EXPECT_EQ(finished.error().message, told[0]);
  EXPECT_EQ(told.size(), 1u);
  const SoundStatistics after = sound.statistics();
  EXPECT_EQ(after.recordingError, told[0]);
  EXPECT_EQ(after.posted, 20u);
  EXPECT_EQ(fatesOf(after), 20u);
  EXPECT_EQ(after.heard, 10u);
  EXPECT_EQ(after.lost, 10u);
  EXPECT_EQ(onsetsOf(test::readRecording(folder / "full.wav")).size(), 10u);
  EXPECT_EQ(folder.entries(), 1u);
}

}  // namespace
}  // namespace carom
