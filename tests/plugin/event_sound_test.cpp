#include "carom/event_sound.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "carom/audio/sound_file.h"
#include "carom/audio/synth.h"
#include "tests/audio/ball_drop.h"
#include "tests/audio/ringing_box.h"
#include "tests/support/constants.h"
#include "tests/support/recording.h"
#include "tests/support/temporary_folder.h"

namespace carom {
namespace {

using namespace test;

using test::BallDrop;
using test::kBall;
using test::kFloor;
using test::readRecording;
using test::Recording;
using test::TemporaryFolder;
using testing::HasSubstr;

BallDrop drop(double time) {
  return {.radius = 0.01, .speed = 1.0, .time = time};
}

SoundSettings near(SoundClock clock = SoundClock::simulation) {
  SoundSettings settings;
  settings.clock = clock;
  settings.listeners = {{"near", {0.0, 0.2, 0.3}}};
  return settings;
}

EventSound made(const SoundSettings& settings) {
  Result<EventSound> sound = EventSound::create(settings);
  EXPECT_TRUE(sound) << sound.error().message;
  EXPECT_TRUE(sound->setBody(kBall, drop(0.0).ball()));
  EXPECT_TRUE(sound->setBody(kFloor, drop(0.0).floor()));
  return *std::move(sound);
}

std::vector<float> offline(const SoundSettings& settings, const std::vector<double>& times,
                           std::size_t frames) {
  Synth synth = test::makeSynth(drop(0.0), settings.listeners, settings.synth);
  for (const double time : times)
    synth.schedule(drop(time).event());
  return test::renderPlanes<float>(synth, frames)[0];
}

std::vector<float> pulled(EventSound& sound, std::size_t frames) {
  std::vector<float> samples(frames);
  float* const channel = samples.data();
  sound.render(std::span(&channel, 1), frames);
  return samples;
}

/// The floor with so many modes from 200 Hz on, which ring for a long time.
SoundBody ringingFloor(std::size_t modes) {
  std::vector<test::Tone> tones;
  for (std::size_t mode = 0; mode < modes; ++mode)
    tones.push_back({200.0 + 61.0 * static_cast<double>(mode), 1.0, 1e-4});
  SoundBody floor = drop(0.0).floor();
  floor.modal = test::boxOf(tones);
  return floor;
}

TEST(EventSoundReport, SaysWhatAHostHasToldAndWhyItIsSilent) {
  Result<EventSound> silent = EventSound::create({});
  ASSERT_TRUE(silent);
  EXPECT_THAT(silent->report(), HasSubstr("0 bodies can move, 0 cannot"));
  EXPECT_THAT(silent->report(), HasSubstr("as none was set"));
  EXPECT_THAT(silent->report(), HasSubstr("Nothing plays, records or pulls this sound yet"));

  EventSound sound = made(near());
  ASSERT_TRUE(sound.prepareRendering(48000.0));
  EXPECT_THAT(sound.report(), HasSubstr("No collision has been told yet"));
  sound.post(drop(0.01).event());
  sound.advanceTo(0.1);
  pulled(sound, 4800);
  const std::string report = sound.report();
  EXPECT_THAT(report, HasSubstr("1 body can move, 1 cannot"));
  EXPECT_THAT(report, HasSubstr("1 " + drop(0.0).ball().material.name));
  EXPECT_THAT(report, HasSubstr("The listener was set at (0, 0.2, 0.3) m"));
  EXPECT_THAT(report, HasSubstr("Heard: 1 click,"));
  EXPECT_THAT(report, HasSubstr("The loudest so far has"));
  ASSERT_TRUE(sound.close());
  EXPECT_THAT(sound.report(), HasSubstr("The sound is closed"));
}

TEST(EventSound, IsSilentBeforeItIsPrepared) {
  EventSound sound = made(near());
  sound.post(drop(0.01).event());
  sound.advanceTo(0.1);
  for (const float sample : pulled(sound, 1000))
    ASSERT_EQ(sample, 0.0F);
  EXPECT_EQ(sound.framesReady(), 0U);
}

TEST(EventSound, PreparedAgainAtAnotherRateItGoesOnAtThatRate) {
  EventSound sound = made(near());
  for (const double rate : {48000.0, 44100.0, 96000.0}) {
    ASSERT_TRUE(sound.prepareRendering(rate));
    EXPECT_EQ(sound.sampleRate(), rate);
    SoundSettings settings = near();
    settings.synth.sampleRate = rate;
    sound.post(drop(0.02).event());
    sound.advanceTo(sound.time() + 1e-3);
    const auto frames = static_cast<std::size_t>(0.05 * rate);
    EXPECT_EQ(pulled(sound, frames), offline(settings, {0.02}, frames)) << rate;
  }
  EXPECT_FALSE(sound.prepareRendering(1.0));
  EXPECT_FALSE(sound.prepareRendering(std::nan("")));
  EXPECT_EQ(sound.sampleRate(), 96000.0);  // unchanged
  EXPECT_EQ(sound.statistics().events, 3U);
}

/// Takes all that waits, in reads of odd sizes.
std::vector<float> taken(EventSound& sound) {
  std::vector<float> all;
  std::vector<float> some(97);
  while (const std::size_t frames = sound.takeCaptured(some))
    all.insert(all.end(), some.begin(), some.begin() + static_cast<std::ptrdiff_t>(frames));
  return all;
}

TEST(EventSound, CapturesWhatTheOfflineRendererGivesAsManyFramesAsTimeSays) {
  for (const double step : {1.0 / 240.0, 1.0 / 60.0, 0.001, 0.0123}) {
    const SoundSettings settings = near();
    EventSound sound = made(settings);
    EXPECT_EQ(sound.capturedFrames(), 0U);
    ASSERT_TRUE(sound.capture());
    const std::vector<double> times = {0.1, 0.105, 0.3};
    std::vector<float> samples;
    double time = 0.0;  // sums up roundings, as a simulation's does
    for (int count = 1; time < 10.0; ++count) {
      for (const double event : times)
        if (event > time && event <= time + step) sound.post(drop(event).event());
      time += step;
      sound.advanceTo(time);
      const auto due = static_cast<std::size_t>(std::floor(count * step * kRate + 0.01));
      ASSERT_EQ(samples.size() + sound.capturedFrames(), due) << step << " s, step " << count;
      const std::vector<float> more = taken(sound);
      samples.insert(samples.end(), more.begin(), more.end());
    }
    const auto late = static_cast<std::ptrdiff_t>(settings.latency * kRate);
    EXPECT_TRUE(std::all_of(samples.begin(), samples.begin() + late,
                            [](float sample) { return sample == 0.0F; }));
    samples.erase(samples.begin(), samples.begin() + late);
    EXPECT_EQ(samples, offline(near(), times, samples.size())) << step;
    EXPECT_EQ(sound.statistics().heard, 3U);
  }
}

TEST(EventSound, CapturesAnewBesideARecordingThatGoesOn) {
  const TemporaryFolder folder;
  EventSound sound = made(near());
  ASSERT_TRUE(sound.record(folder.path() / "whole.wav"));
  ASSERT_TRUE(sound.capture());
  sound.post(drop(0.01).event());
  sound.advanceTo(0.1);
  EXPECT_EQ(sound.capturedFrames(), 4800U);
  ASSERT_TRUE(sound.capture());
  EXPECT_EQ(sound.capturedFrames(), 0U);
  sound.advanceTo(0.2);
  for (const float sample : taken(sound))
    ASSERT_EQ(sample, 0.0F);  // the click of before belongs to the capture of before
  EXPECT_EQ(sound.statistics().posted, 1U);
  EXPECT_EQ(sound.statistics().heard, 1U);
  EXPECT_TRUE(sound.close());
  EXPECT_EQ(sound.capturedFrames(), 0U);
  EXPECT_FALSE(sound.capture());
  const Recording recording = readRecording(folder.path() / "whole.wav");
  EXPECT_GE(recording.samples.size(), 9600U);
  EXPECT_GT(std::abs(*std::ranges::max_element(recording.samples)), 0.0F);
}

TEST(EventSound, RecordsWhatTheOfflineRendererGives) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "clicks.wav";
  SoundSettings settings = near();
  settings.fullScale = 1.0;
  EventSound sound = made(settings);
  ASSERT_TRUE(sound.record(file));
  EXPECT_FALSE(sound.record(folder.path() / "second.wav"));
  const std::vector<double> times = {0.1, 0.105, 0.3};
  for (int step = 1; step <= 100; ++step) {
    for (const double time : times)
      if (time > 0.005 * (step - 1) && time <= 0.005 * step) sound.post(drop(time).event());
    sound.advanceTo(0.005 * step);
  }
  EXPECT_FALSE(std::filesystem::exists(file));
  ASSERT_TRUE(sound.finishRecording());
  const Recording recording = readRecording(file);
  ASSERT_GE(recording.samples.size(), static_cast<std::size_t>(0.5 * kRate));
  const std::vector<float> wanted = offline(near(), times, recording.samples.size());
  EXPECT_TRUE(std::ranges::equal(recording.samples, wanted));
  EXPECT_TRUE(sound.finishRecording());  // there is no recording
  EXPECT_EQ(sound.statistics().events, 3U);
}

TEST(EventSound, RecordsWhileItIsPulled) {
  const TemporaryFolder folder;
  SoundSettings settings = near();
  settings.fullScale = 1.0;
  EventSound sound = made(settings);
  ASSERT_TRUE(sound.record(folder.path() / "both.wav"));
  ASSERT_TRUE(sound.prepareRendering(kRate));
  std::vector<float> samples;
  for (int step = 1; step <= 50; ++step) {
    if (step % 10 == 0) sound.post(drop(0.01 * step - 0.004).event());
    sound.advanceTo(0.01 * step);
    const std::vector<float> part = pulled(sound, sound.framesReady());
    samples.insert(samples.end(), part.begin(), part.end());
  }
  ASSERT_TRUE(sound.finishRecording());
  const Recording recording = readRecording(folder.path() / "both.wav");
  ASSERT_GE(recording.samples.size(), samples.size());
  EXPECT_TRUE(std::equal(samples.begin(), samples.end(), recording.samples.begin()));
  EXPECT_EQ(sound.statistics().events, 5U);
}

// Events that cross the queue, pulled in blocks of any size, give the bits of Synth.
TEST(EventSound, ABodyRingsAsOffline) {
  const SoundBody floor = ringingFloor(200);
  SoundSettings settings = near();
  settings.budget.modes = 200;
  EventSound sound = made(settings);
  ASSERT_TRUE(sound.setBody(kFloor, floor));
  ASSERT_TRUE(sound.prepareRendering(kRate));
  Synth synth = test::makeSynth(drop(0.0), settings.listeners, settings.synth);
  ASSERT_TRUE(synth.setBody(kFloor, floor));
  std::vector<float> samples;
  for (int step = 1; step <= 40; ++step) {
    if (step % 7 == 0) {
      const ImpulseEvent event = test::floorShare(test::dropOnBox(0.01 * step - 0.004));
      sound.post(event);
      synth.schedule(event);
    }
    sound.advanceTo(0.01 * step);
    while (sound.framesReady() > 0) {
      const std::vector<float> part = pulled(
          sound,
          std::min<std::size_t>(sound.framesReady(), 37 + 11 * static_cast<std::size_t>(step % 5)));
      samples.insert(samples.end(), part.begin(), part.end());
    }
  }
  EXPECT_EQ(samples, test::renderPlanes<float>(synth, samples.size())[0]);
  EXPECT_GT(std::ranges::max(samples), 1e-3F);
  EXPECT_EQ(sound.statistics().rings, 5U);
  EXPECT_EQ(sound.statistics().ringing, 1U);
  EXPECT_EQ(sound.statistics().modes, 200U);
  EXPECT_EQ(sound.statistics().modalVoicesExhausted, 0U);
}

TEST(EventSound, BeyondItsBudgetBodiesRingInFewerModesOrNotAtAll) {
  SoundSettings settings = near();
  settings.budget.modes = 10;
  settings.budget.ringingBodies = 2;
  EventSound sound = made(settings);
  for (const BodyId id : {10U, 11U, 12U})
    ASSERT_TRUE(sound.setBody(id, ringingFloor(50)));
  ASSERT_TRUE(sound.prepareRendering(kRate));
  for (const BodyId id : {10U, 11U, 12U}) {
    ImpulseEvent event = test::floorShare(test::dropOnBox(0.01));
    event.body = id;
    sound.post(event);
  }
  sound.advanceTo(0.1);
  EXPECT_GT(std::ranges::max(pulled(sound, 2000)), 1e-3F);
  EXPECT_EQ(sound.statistics().ringing, 2U);
  EXPECT_EQ(sound.statistics().modes, 2U * 16U);  // modes come in whole vectors
  EXPECT_EQ(sound.statistics().modalVoicesExhausted, 1U);
}

TEST(EventSound, WhatRangAndWhatDidNotIsCountedOnWhenItHasStopped) {
  SoundSettings settings = near();
  settings.budget.ringingBodies = 1;
  EventSound sound = made(settings);
  for (const BodyId id : {10U, 11U})
    ASSERT_TRUE(sound.setBody(id, ringingFloor(8)));
  for (int round = 1; round <= 2; ++round) {
    ASSERT_TRUE(sound.prepareRendering(kRate));
    for (const BodyId id : {10U, 11U}) {
      ImpulseEvent event = test::floorShare(test::dropOnBox(round - 0.09));
      event.body = id;
      sound.post(event);
    }
    sound.advanceTo(round);
    while (sound.framesReady() > 0)
      (void)pulled(sound, std::min<std::size_t>(sound.framesReady(), 1000));
    sound.stop();
    EXPECT_EQ(sound.statistics().rings, 2U * static_cast<unsigned>(round));
    EXPECT_EQ(sound.statistics().modalVoicesExhausted, static_cast<unsigned>(round));
    EXPECT_EQ(sound.statistics().ringing, 0U);
  }
}

TEST(EventSound, WhatRangInARecordingIsCounted) {
  const TemporaryFolder folder;
  EventSound sound = made(near());
  ASSERT_TRUE(sound.setBody(10, ringingFloor(8)));
  ASSERT_TRUE(sound.record(folder.path() / "rings.wav"));
  ImpulseEvent event = test::floorShare(test::dropOnBox(0.01));
  event.body = 10;
  sound.post(event);
  sound.advanceTo(0.1);
  EXPECT_EQ(sound.statistics().rings, 1U);
  ASSERT_TRUE(sound.finishRecording());
  EXPECT_EQ(sound.statistics().rings, 1U);
}

TEST(EventSound, ARecordingCanBeginLaterAndLeavesLeapsOut) {
  const TemporaryFolder folder;
  SoundSettings settings = near();
  settings.fullScale = 1.0;
  EventSound sound = made(settings);
  sound.advanceTo(1000.0);
  ASSERT_TRUE(sound.record(folder.path() / "late.wav"));
  sound.post(drop(1000.1).event());
  sound.advanceTo(1000.2);
  sound.advanceTo(5000.0);  // a jump of more than a minute
  sound.post(drop(5000.1).event());
  sound.advanceTo(5000.2);
  ASSERT_TRUE(sound.finishRecording());
  const Recording recording = readRecording(folder.path() / "late.wav");
  EXPECT_LT(recording.samples.size(), static_cast<std::size_t>(0.6 * kRate));
  EXPECT_GT(recording.samples.size(), static_cast<std::size_t>(0.3 * kRate));
}

TEST(EventSound, ARecordingSurvivesAClockThatTellsNonsense) {
  const TemporaryFolder folder;
  EventSound sound = made(near());
  ASSERT_TRUE(sound.record(folder / "clicks.wav"));
  sound.post(drop(0.01).event());
  sound.advanceTo(0.1);
  for (const double nonsense : {1e18, -1e300, HUGE_VAL, std::nan("")}) {
    sound.advanceTo(nonsense);
    EXPECT_EQ(sound.time(), 0.1);
  }
  const Status finished = sound.finishRecording();
  EXPECT_TRUE(finished) << finished.error().message;
}

TEST(EventSound, ARecordingStaysInItsFolder) {
  const TemporaryFolder folder;
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(folder.path());
  EventSound sound = made(near());
  const Status begun = sound.record("clicks.wav");
  std::filesystem::current_path(before);
  ASSERT_TRUE(begun) << begun.error().message;
  const Status finished = sound.finishRecording();
  EXPECT_TRUE(finished) << finished.error().message;
  EXPECT_TRUE(std::filesystem::exists(folder / "clicks.wav"));
  EXPECT_EQ(folder.entries(), 1U);
}

TEST(EventSound, RefusesFilesThatCannotBe) {
  EventSound sound = made(near());
  const Status refused = sound.record("/no/such/folder/a.wav");
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("/no/such/folder"));
  SoundSettings settings = near();
  settings.record = "/no/such/folder/a.wav";
  EXPECT_FALSE(EventSound::create(settings));
}

TEST(EventSound, DoesNothingOnceItIsClosed) {
  const TemporaryFolder folder;
  SoundSettings settings = near();
  settings.record = folder / "closed.wav";
  EventSound sound = made(settings);
  ASSERT_TRUE(sound.prepareRendering(48000.0));
  sound.post(drop(0.01).event());
  sound.advanceTo(0.1);
  ASSERT_TRUE(sound.close());
  EXPECT_TRUE(std::filesystem::exists(folder / "closed.wav"));
  EXPECT_FALSE(sound.setBody(kBall, drop(0.0).ball()));
  EXPECT_FALSE(sound.setListener({0.0, 1.0, 0.0}));
  EXPECT_FALSE(sound.setTimeScale(0.5));
  EXPECT_FALSE(sound.play());
  EXPECT_FALSE(sound.prepareRendering(48000.0));
  EXPECT_FALSE(sound.record(folder / "after.wav"));
  sound.post(drop(0.2).event());
  sound.advanceTo(0.3);
  sound.removeBody(kBall);
  EXPECT_EQ(sound.time(), 0.1);
  EXPECT_EQ(sound.statistics().events, 1U);
  for (const float sample : pulled(sound, 1000))
    ASSERT_EQ(sample, 0.0F);
  EXPECT_TRUE(sound.finishRecording());
  EXPECT_TRUE(sound.close());
  EXPECT_EQ(folder.entries(), 1U);
}

TEST(EventSound, RefusesSettingsThatCannotBe) {
  const auto isRefused = [](auto change) {
    SoundSettings settings = near();
    change(settings);
    return !EventSound::create(settings);
  };
  for (const double bad : {-1.0, std::nan(""), HUGE_VAL}) {
    EXPECT_TRUE(isRefused([&](SoundSettings& s) { s.latency = bad; })) << bad;
    EXPECT_TRUE(isRefused([&](SoundSettings& s) { s.fullScale = bad; })) << bad;
    EXPECT_TRUE(isRefused([&](SoundSettings& s) { s.budget.longestContact = bad; })) << bad;
    EXPECT_TRUE(isRefused([&](SoundSettings& s) { s.synth.sampleRate = bad; })) << bad;
  }
  EXPECT_TRUE(isRefused([](SoundSettings& s) { s.budget.cpuShare = 0.0; }));
  EXPECT_TRUE(isRefused([](SoundSettings& s) { s.budget.cpuShare = std::nan(""); }));
  EXPECT_TRUE(isRefused([](SoundSettings& s) { s.budget.voices = 0; }));
  EXPECT_TRUE(isRefused([](SoundSettings& s) { s.budget.voices = std::size_t{1} << 60; }));
  EXPECT_TRUE(isRefused([](SoundSettings& s) { s.budget.buses = 0; }));
  EXPECT_TRUE(isRefused([](SoundSettings& s) { s.limiter.emplace().ceiling = -1.0F; }));
}

TEST(EventSound, TakesNonsenseWithoutHarm) {
  EventSound sound = made(near());
  ASSERT_TRUE(sound.prepareRendering(kRate));
  ImpulseEvent event = drop(0.02).event();
  event.time = std::nan("");
  sound.post(event);
  event = drop(0.02).event();
  event.impulse.x() = HUGE_VAL;
  sound.post(event);
  event = drop(0.02).event();
  event.body = 77;
  sound.post(event);
  event = drop(1e300).event();
  sound.post(event);
  sound.advanceTo(std::nan(""));
  EXPECT_EQ(sound.time(), 0.0);
  sound.advanceTo(0.1);
  EXPECT_EQ(sound.statistics().rejected, 4U);
  EXPECT_FALSE(sound.setBody(3, {.material = *findMaterial("steel"), .mass = -1.0}));
  EXPECT_FALSE(sound.setListener({0.0, std::nan(""), 0.0}));
  EXPECT_FALSE(sound.setListener({0.0, 0.0, 0.0}, Quat(2.0, 0.0, 0.0, 0.0)));
  EXPECT_FALSE(sound.setListener({0.0, 0.0, 0.0}, Quat::Identity(), 1));
  for (const double scale : {0.0, -1.0, std::nan(""), HUGE_VAL})
    EXPECT_FALSE(sound.setTimeScale(scale));
  sound.removeBody(99);
  for (const float sample : pulled(sound, 4800))
    ASSERT_EQ(sample, 0.0F);
}

TEST(EventSound, EventsOfARemovedBodyAreRejectedAndItsSoundGoesOn) {
  EventSound sound = made(near());
  ASSERT_TRUE(sound.prepareRendering(kRate));
  sound.post(drop(0.02).event());
  sound.advanceTo(0.025);
  sound.removeBody(kBall);
  sound.post(drop(0.03).event());
  sound.advanceTo(0.04);
  EXPECT_EQ(sound.statistics().rejected, 1U);
  EXPECT_EQ(pulled(sound, 4800), offline(near(), {0.02}, 4800));
}

TEST(EventSound, GoesOnWhereItsClockGoesBack) {
  EventSound sound = made(near());
  ASSERT_TRUE(sound.prepareRendering(kRate));
  sound.post(drop(0.02).event());
  sound.advanceTo(0.25);
  sound.advanceTo(0.0);  // begun anew
  EXPECT_EQ(sound.statistics().jumps, 1U);
  sound.post(drop(0.02).event());
  sound.advanceTo(0.25);
  std::vector<float> expected = offline(near(), {0.02, 0.27}, 19200);
  EXPECT_EQ(pulled(sound, 19200), expected);
  EXPECT_EQ(sound.statistics().heard, 2U);
}

// A vase that breaks: the host tells the hit, and takes the vase away in the same step.
TEST(EventSound, WhatIsPostedBeforeABodyIsRemovedIsHeard) {
  EventSound sound = made(near());
  ASSERT_TRUE(sound.prepareRendering(kRate));
  sound.post(drop(0.02).event());
  sound.removeBody(kBall);
  sound.post(drop(0.021).event());
  ASSERT_TRUE(sound.setBody(kBall, drop(0.0).ball()));
  sound.post(drop(0.022).event());
  sound.advanceTo(0.025);
  sound.removeBody(kBall);
  sound.post(drop(0.03).event());
  sound.advanceTo(0.04);
  EXPECT_EQ(sound.statistics().rejectedUnknownBody, 2U);
  EXPECT_EQ(pulled(sound, 4800), offline(near(), {0.02, 0.022}, 4800));
}

/// A ball on a box that rings, told of once, and the decay (1/s) of a later blow on the box.
class Touched {
 public:
  explicit Touched(SoundClock clock) : sound_(made(settingsOf(clock))) {
    SoundBody box = drop(0.0).floor();
    box.modal = boxOf({{1000.0, 2.0, 1.0}});
    EXPECT_TRUE(sound_.setBody(kFloor, box));
  }
  EventSound& sound() { return sound_; }
  void tell(ContactPhase phase) {
    ContactState contact;
    contact.body = kBall;
    contact.other = kFloor;
    contact.phase = phase;
    contact.time = time_;
    contact.duration = kStep;
    contact.normal = Vec3::UnitZ();
    contact.normalLoad = phase == ContactPhase::end ? 0.0 : 1e-4;
    contact.otherPathStart = contact.otherPathEnd = Vec3(0.0, 0.0, 0.01);
    sound_.updateContact(contact);
  }
  void step() { sound_.advanceTo(time_ += kStep); }
  void goBack() { sound_.advanceTo(time_ = 0.0); }
  void pull() { samples_ = pulled(sound_, 200); }
  double decayOfABlow() {
    sound_.post(floorShare(dropOnBox(time_)));
    std::vector<float> all;
    for (int count = 0; count < 240; ++count) {
      step();
      const std::vector<float> more = pulled(sound_, 200);
      all.insert(all.end(), more.begin(), more.end());
    }
    const auto blow =
        std::ranges::max_element(all, {}, [](float sample) { return std::abs(sample); });
    const auto level = [&](std::ptrdiff_t after) {
      double power = 0.0;
      for (auto at = blow + after; at < blow + after + 2400; ++at)
        power += static_cast<double>(*at) * static_cast<double>(*at);
      return std::sqrt(power);
    };
    return std::log(level(4800) / level(14400)) / 0.2;
  }

 private:
  static SoundSettings settingsOf(SoundClock clock) {
    SoundSettings settings = near(clock);
    settings.synth.contactLoss = 0.05;
    return settings;
  }
  static constexpr double kStep = 1.0 / 240.0;
  EventSound sound_;
  double time_ = 0.0;
  std::vector<float> samples_;
};

// Steps that come before the host's audio thread has begun are not heard.
TEST(EventSound, KnowsWhatLayThereBeforeItWasFirstPulled) {
  Touched touched(SoundClock::realTime);
  touched.tell(ContactPhase::begin);
  touched.step();
  ASSERT_TRUE(touched.sound().prepareRendering(kRate));
  touched.step();
  touched.pull();
  EXPECT_GT(touched.decayOfABlow(), 7.0);
}

TEST(EventSound, WhatPartsWhileStepsAreSkippedDampsNoMore) {
  Touched touched(SoundClock::realTime);
  ASSERT_TRUE(touched.sound().prepareRendering(kRate));
  touched.pull();
  for (int count = 0; count < 20; ++count) {
    touched.step();
    touched.pull();
  }
  touched.tell(ContactPhase::begin);
  touched.step();
  touched.pull();
  for (int count = 0; count < 480; ++count) {  // at once: more than may wait
    if (count == 300) touched.tell(ContactPhase::end);
    touched.step();
  }
  for (int count = 0; count < 120; ++count) {
    touched.pull();
    touched.step();
  }
  EXPECT_NEAR(touched.decayOfABlow(), 2.0, 0.3);
}

TEST(EventSound, WhatPartsAsTheClockGoesBackDampsNoMore) {
  for (const SoundClock clock : {SoundClock::simulation, SoundClock::realTime}) {
    Touched touched(clock);
    ASSERT_TRUE(touched.sound().prepareRendering(kRate));
    touched.pull();
    touched.tell(ContactPhase::begin);
    for (int count = 0; count < 20; ++count) {
      touched.step();
      touched.pull();
    }
    touched.tell(ContactPhase::end);
    touched.goBack();
    EXPECT_NEAR(touched.decayOfABlow(), 2.0, 0.3);
  }
}

// A soft ball touches what rings many times in one blow: more often than the samples of the longest
// contact are, at a low rate. The sanitizers look at the memory.
TEST(EventSound, ABlowOfManyTouchesHasRoomAtALowSampleRate) {
  SoundSettings settings = near();
  settings.synth.sampleRate = 8000.0;
  settings.budget.longestContact = 0.01;
  EventSound sound = made(settings);
  BallDrop soft = dropOnBox(0.05);
  soft.material.youngsModulus = 1e6;
  soft.material.density = 1000.0;
  soft.radius = 0.03;
  soft.speed = 4.0;
  soft.centre = {0.0, 0.0, 0.04};
  SoundBody bell = soft.floor();
  bell.modal = boxOf({{1000.0, 2.0, 1e-3}});
  ASSERT_TRUE(sound.setBody(kBall, soft.ball()) && sound.setBody(kFloor, bell));
  ASSERT_TRUE(sound.prepareRendering(8000.0));
  ImpulseEvent onBall = soft.event();
  ImpulseEvent onBell = floorShare(soft);
  exchangePoses(onBall, onBell);
  sound.post(onBall);
  sound.post(onBell);
  float peak = 0.0F;
  for (int step = 1; step < 60; ++step) {
    sound.advanceTo(step / 240.0);
    for (const float sample : pulled(sound, sound.framesReady()))
      peak = std::max(peak, std::abs(sample));
  }
  EXPECT_EQ(sound.statistics().events, 2U);
  EXPECT_TRUE(std::isfinite(peak) && peak > 0.0F);
}

// In slow motion a step of what slides lasts longer than the longest contact.
TEST(EventSound, WhatSlidesSoundsInSlowMotion) {
  SoundSettings settings = near(SoundClock::realTime);
  settings.latency = 0.3;
  EventSound sound = made(settings);
  ASSERT_TRUE(
      sound.setBody(kBall, {.material = *findMaterial("wood"), .mass = 0.5, .radius = 0.05}));
  ASSERT_TRUE(sound.setBody(kFloor, {.material = *findMaterial("concrete")}));
  constexpr double kScale = 0.25;
  constexpr double kFrame = 1.0 / 60.0;
  ASSERT_TRUE(sound.setTimeScale(kScale) && sound.prepareRendering(kRate));
  pulled(sound, 480);
  double power = 0.0;
  for (int frame = 0; frame < 30; ++frame) {
    const double x = frame * kFrame;  // at 1 m/s
    ContactState contact;
    contact.time = x;
    contact.duration = kFrame;
    contact.phase = frame > 0 ? ContactPhase::during : ContactPhase::begin;
    contact.body = kBall;
    contact.other = kFloor;
    contact.normal = Vec3::UnitZ();
    contact.position = {x, 0.0, 0.0};
    contact.normalLoad = 4.9;
    contact.appliedImpulse = kFrame * 4.9 * Vec3(-0.3, 0.0, 1.0);
    contact.slipVelocity = contact.bodyVelocity = Vec3::UnitX();
    contact.bodyPosition = {x, 0.0, 0.05};
    contact.pathStart = contact.pathEnd = {0.0, 0.0, -0.05};
    contact.otherPathStart = contact.position;
    contact.otherPathEnd = contact.position + kFrame * Vec3::UnitX();
    sound.updateContact(contact);
    sound.advanceTo(x + kFrame);
    for (const float sample : pulled(sound, 3200))
      power += static_cast<double>(sample) * static_cast<double>(sample);
  }
  EXPECT_GT(power, 0.0);
  EXPECT_EQ(sound.statistics().slidesLeftOut, 0U);
}

// The id of what is taken away serves another body at once: what rang stays where it was.
TEST(EventSound, ANewBodysPlaceDoesNotMoveWhatRangBeforeIt) {
  const auto heard = [](bool isMoved) {
    EventSound sound = made(near());
    EXPECT_TRUE(sound.prepareRendering(kRate));
    SoundBody floor = drop(0.0).floor();
    floor.modal = boxOf({{1000.0, 5.0, 1.0}});
    EXPECT_TRUE(sound.setBody(kFloor, floor));
    sound.post(floorShare(drop(0.02)));
    sound.advanceTo(0.025);
    sound.post(drop(0.03).event());
    sound.removeBody(kFloor);
    EXPECT_TRUE(sound.setBody(kFloor, drop(0.0).floor()));
    if (isMoved) {
      EXPECT_TRUE(sound.moveBody(kFloor, {0.031, {0.0, 0.0, -30.0}}));
    }
    for (double time = 0.035; time < 0.2; time += 0.01)
      sound.advanceTo(time);
    return pulled(sound, 7200);
  };
  const std::vector<float> moved = heard(true);
  EXPECT_EQ(moved, heard(false));
  EXPECT_GT(*std::ranges::max_element(moved), 0.0F);
}

/// Sets the environment variables by which SDL chooses its driver.
class Device : public testing::TestWithParam<const char*> {
 protected:
  Device() {
    setenv("SDL_AUDIODRIVER", GetParam(), 1);
    setenv("SDL_DISKAUDIOFILE", file().c_str(), 1);
  }
  ~Device() override {
    unsetenv("SDL_AUDIODRIVER");
    unsetenv("SDL_DISKAUDIOFILE");
  }
  std::filesystem::path file() const { return folder_.path() / "played.raw"; }

  std::vector<float> played() const {
    std::ifstream stream(file(), std::ios::binary);
    std::vector<float> samples;
    for (float sample = 0; stream.read(reinterpret_cast<char*>(&sample), sizeof sample);)
      samples.push_back(sample);
    return samples;
  }

 private:
  TemporaryFolder folder_;
};

class DiskDevice : public Device {};
class DummyDevice : public Device {};
class NoDevice : public Device {};

/// Steps until the condition holds, or gives up after a long time.
template <class Condition>
void stepUntil(EventSound& sound, Condition isDone) {
  for (int turn = 0; turn < 5000 && !isDone(); ++turn) {
    sound.advanceTo(sound.time() + 1.0 / 240.0);
    std::this_thread::sleep_for(std::chrono::milliseconds(4));
  }
}

std::vector<float> fromOnset(const std::vector<float>& samples, std::size_t count) {
  const auto onset = std::ranges::find_if(samples, [](float p) { return p != 0.0F; });
  const auto left = static_cast<std::size_t>(samples.end() - onset);
  return {onset, onset + static_cast<std::ptrdiff_t>(std::min(left, count))};
}

// The device gets the bits of the offline renderer, divided by full scale.
TEST_P(DiskDevice, GetsTheSamplesOfTheOfflineRenderer) {
  SoundSettings settings = near(SoundClock::realTime);
  settings.fullScale = 8.0;  // Pa, so high that the limiter does nothing
  EventSound sound = made(settings);
  ASSERT_TRUE(sound.play());
  stepUntil(sound, [&] { return sound.statistics().cpuShare > 0.0; });  // until the device pulls
  sound.pause();  // sets the clock here, whatever this machine does
  sound.advanceTo(sound.time() + 1.0 / 240.0);
  const double time = sound.time() + 1.0 / 480.0;
  sound.post(drop(time).event());
  const std::uintmax_t before = std::filesystem::file_size(file());
  // The file grows by a second of two channels, so that all of the sound has been pulled.
  stepUntil(sound, [&] {
    return std::filesystem::file_size(file()) > before + std::uintmax_t{48000} * 8;
  });
  EXPECT_EQ(sound.statistics().events, 1U);
  settings.synth.sampleRate = sound.sampleRate();
  sound.stop();
  std::vector<float> left;
  const std::vector<float> stereo = played();
  for (std::size_t i = 0; i + 1 < stereo.size(); i += 2) {
    ASSERT_EQ(stereo[i], stereo[i + 1]);  // one microphone, both loudspeakers
    left.push_back(stereo[i]);
  }
  std::vector<float> wanted =
      offline(settings, {time}, static_cast<std::size_t>((time + 0.1) * settings.synth.sampleRate));
  for (float& sample : wanted)
    sample /= 8.0F;
  ASSERT_FALSE(fromOnset(left, 500).empty());
  EXPECT_EQ(fromOnset(left, 500), fromOnset(wanted, 500));
}
INSTANTIATE_TEST_SUITE_P(Sdl, DiskDevice, testing::Values("disk"));

TEST_P(DummyDevice, PlaysAndStopsAndPlaysAgain) {
  EventSound sound = made(near(SoundClock::realTime));
  for (int round = 0; round < 3; ++round) {
    ASSERT_TRUE(sound.play());
    EXPECT_TRUE(sound.isPlaying());
    sound.advanceTo(sound.time() + 0.01);
    const SoundStatistics before = sound.statistics();
    setenv("SDL_AUDIODRIVER", "nosuchdriver", 1);
    ASSERT_TRUE(sound.play());  // it plays already
    setenv("SDL_AUDIODRIVER", GetParam(), 1);
    EXPECT_EQ(sound.statistics().jumps, before.jumps);
    sound.advanceTo(sound.time() + 0.01);
    sound.stop();
    ASSERT_TRUE(sound.prepareRendering(kRate));
    EXPECT_FALSE(sound.play());  // the host pulls the samples
    sound.stop();
  }
}
TEST_P(DummyDevice, LeavesTheSignalsToTheHost) {
  EventSound sound = made(near(SoundClock::realTime));
  ASSERT_TRUE(sound.play());
  for (const int signal : {SIGINT, SIGTERM}) {
    struct sigaction now = {};
    ASSERT_EQ(sigaction(signal, nullptr, &now), 0);
    EXPECT_EQ(now.sa_handler, SIG_DFL);
  }
}

INSTANTIATE_TEST_SUITE_P(Sdl, DummyDevice, testing::Values("dummy"));

TEST_P(NoDevice, IsRefusedWithAReason) {
  EventSound sound = made(near(SoundClock::realTime));
  const Status played = sound.play();
  ASSERT_FALSE(played);
  EXPECT_FALSE(sound.isPlaying());
  EXPECT_THAT(played.error().message, HasSubstr("audio device"));
}

// An application goes on where nothing can be heard; what it records is complete.
TEST_P(NoDevice, IsToldAndNoMoreWhereTheSettingsAskForOne) {
  const TemporaryFolder folder;
  std::vector<std::string> told;
  SoundSettings settings = near(SoundClock::realTime);
  settings.play = true;
  settings.record = folder / "unheard.wav";
  settings.onMessage = [&told](const std::string& sentence) { told.push_back(sentence); };
  Result<EventSound> sound = EventSound::create(settings);
  ASSERT_TRUE(sound);
  EXPECT_FALSE(sound->isPlaying());
  ASSERT_EQ(told.size(), 1U);
  EXPECT_THAT(told[0], HasSubstr("audio device"));
  EXPECT_TRUE(sound->close());
  EXPECT_TRUE(std::filesystem::exists(settings.record));
}
INSTANTIATE_TEST_SUITE_P(Sdl, NoDevice, testing::Values("nosuchdriver"));

}  // namespace
}  // namespace carom
