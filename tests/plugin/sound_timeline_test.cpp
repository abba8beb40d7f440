#include "plugin/realtime/sound_timeline.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <gtest/gtest.h>

#include "tests/support/constants.h"

namespace carom {

using namespace audio;
using namespace plugin;

namespace {

using namespace test;

constexpr double kLatency = 0.05;             // s
constexpr double kTimelineStep = 1.0 / 60.0;  // s
constexpr double kWhole = kLatency * kRate;

/// Look-ahead in samples, from the audio thread's position to the present instant.
double lookAhead(const SoundTimeline& timeline, double time, std::int64_t rendered) {
  const SampleShift shift = timeline.shiftAt(time);
  return time * kRate + static_cast<double>(shift.whole) + shift.fraction -
         static_cast<double>(rendered);
}

/// A simulation and a sound card with clocks of their own; samples are rendered in whole blocks.
struct Player {
  SoundTimeline timeline{SoundClock::realTime, kRate, kLatency};
  double wall = 0.0;        // s
  double time = 100.0;      // s, of the simulation
  double cardRate = kRate;  // Hz, by the wall clock
  double block = 480.0;     // samples

  std::int64_t rendered() const {
    return static_cast<std::int64_t>(std::ceil(wall * cardRate / block) * block) +
           static_cast<std::int64_t>(block);
  }
  TimelineStep step(double simulated, double passed) {
    wall += passed;
    time += simulated;
    return timeline.advance(time, rendered());
  }
  TimelineStep step() { return step(kTimelineStep, kTimelineStep); }
  double ahead() const { return lookAhead(timeline, time, rendered()); }
};

TEST(SoundTimeline, LeavesTheClockOfTheSimulationAloneIfAskedTo) {
  SoundTimeline timeline(SoundClock::simulation, kRate, kLatency);
  for (const double time : {0.0, 0.1, 77.3}) {
    EXPECT_EQ(timeline.advance(time, 5), TimelineStep::steady);
    EXPECT_EQ(timeline.shiftAt(time).whole, 0);
    EXPECT_EQ(timeline.shiftAt(time).fraction, 0.0);
  }
}

TEST(SoundTimeline, GoesOnWhereTheClockOfTheSimulationGoesBack) {
  SoundTimeline timeline(SoundClock::simulation, kRate, kLatency);
  timeline.advance(2.0, 5);
  EXPECT_EQ(timeline.advance(0.5, 5), TimelineStep::jumped);
  EXPECT_EQ(timeline.shiftAt(0.5).whole, std::llround(1.5 * kRate));
  EXPECT_EQ(timeline.advance(0.6, 5), TimelineStep::steady);
  EXPECT_EQ(timeline.leapt(), std::llround(1.5 * kRate));
}

TEST(SoundTimeline, SkipsWhatNobodyHearsAndBeginsWithTheFirstSample) {
  SoundTimeline timeline(SoundClock::realTime, kRate, kLatency);
  EXPECT_EQ(timeline.advance(1.0, 0), TimelineStep::skipped);
  EXPECT_EQ(timeline.advance(2.0, 0), TimelineStep::skipped);
  EXPECT_EQ(timeline.advance(2.1, 480), TimelineStep::started);
  EXPECT_NEAR(lookAhead(timeline, 2.1, 480), kWhole, 0.5);
}

// The shift is a whole number of samples, so that events keep their fractions and their sound its
// bits.
TEST(SoundTimeline, HoldsAWholeShiftWhileTheClocksAgree) {
  Player player;
  EXPECT_EQ(player.step(), TimelineStep::started);
  const SampleShift first = player.timeline.shiftAt(player.time);
  for (int frame = 0; frame < 36000; ++frame) {  // 10 minutes
    ASSERT_EQ(player.step(), TimelineStep::steady);
    const SampleShift now = player.timeline.shiftAt(player.time);
    ASSERT_EQ(now.fraction, 0.0);
    ASSERT_EQ(now.whole, first.whole) << frame;
  }
}

// The sound card is off by 300 ppm, either way, for an hour: the look-ahead stays within its
// tolerance plus the lumps of steps and blocks, and time never runs more than half a percent off.
TEST(SoundTimeline, FollowsTheSoundCardsClock) {
  for (const double off : {-3e-4, 3e-4}) {
    Player player;
    player.cardRate = kRate * (1.0 + off);
    player.step();
    double last =
        player.time * kRate + static_cast<double>(player.timeline.shiftAt(player.time).whole);
    double least = kWhole;
    double most = kWhole;
    for (int frame = 0; frame < 216000; ++frame) {
      ASSERT_EQ(player.step(), TimelineStep::steady) << frame;
      least = std::min(least, player.ahead());
      most = std::max(most, player.ahead());
      const SampleShift shift = player.timeline.shiftAt(player.time);
      const double now = player.time * kRate + static_cast<double>(shift.whole) + shift.fraction;
      ASSERT_NEAR(now - last, kTimelineStep * kRate, 0.006 * kTimelineStep * kRate + 1.0);
      last = now;
    }
    const double lump = player.block + kTimelineStep * kRate;
    EXPECT_GT(least, kWhole * (1.0 - SoundTimeline::kTolerance) - lump);
    EXPECT_LT(most, kWhole * (1.0 + SoundTimeline::kTolerance) + lump);
  }
}

// The map has no steps while it corrects, so that events keep their order and no sound is heard
// twice.
TEST(SoundTimeline, BendsWithoutSteps) {
  Player player;
  player.cardRate = kRate * 1.001;
  player.step();
  for (int frame = 0; frame < 20000; ++frame) {
    const double before = lookAhead(player.timeline, player.time, 0);
    player.step();
    // The look-ahead of one instant is the same by the map's piece before it and by the piece after
    // it.
    const double after = lookAhead(player.timeline, player.time - kTimelineStep, 0);
    ASSERT_NEAR(after, before, 0.51) << frame;
  }
}

TEST(SoundTimeline, AStallIsOneFaultAndGoesOnWithTheFullLookAhead) {
  Player player;
  player.step();
  for (int frame = 0; frame < 100; ++frame)
    player.step();
  EXPECT_EQ(player.step(kTimelineStep, 1.0), TimelineStep::stalled);
  EXPECT_NEAR(player.ahead(), kWhole, 0.5);
  for (int frame = 0; frame < 100; ++frame)
    EXPECT_EQ(player.step(), TimelineStep::steady);
}

// Bullet makes up for a stall with several substeps at once.
TEST(SoundTimeline, TakesTheExtraLookAheadAfterAStallBackWithinSeconds) {
  Player player;
  player.step();
  EXPECT_EQ(player.step(kTimelineStep, 1.0), TimelineStep::stalled);
  for (int substep = 0; substep < 9; ++substep)
    EXPECT_EQ(player.step(kTimelineStep, 0.0), TimelineStep::steady);
  EXPECT_GT(player.ahead(), 3.0 * kWhole);
  for (int frame = 0; frame < 600; ++frame)
    ASSERT_EQ(player.step(), TimelineStep::steady);
  EXPECT_LT(player.ahead(), (1.0 + SoundTimeline::kTolerance) * kWhole + player.block);
}

TEST(SoundTimeline, APauseIsNoFault) {
  Player player;
  player.step();
  player.timeline.pause();
  EXPECT_EQ(player.step(kTimelineStep, 3600.0), TimelineStep::started);
  EXPECT_NEAR(player.ahead(), kWhole, 0.5);
  EXPECT_EQ(player.step(), TimelineStep::steady);
}

TEST(SoundTimeline, AClockThatGoesBackBeginsAnewThere) {
  Player player;
  player.step();
  EXPECT_EQ(player.step(-50.0, kTimelineStep), TimelineStep::jumped);
  EXPECT_NEAR(player.ahead(), kWhole, 0.5);
  EXPECT_EQ(player.step(), TimelineStep::steady);
}

// The simulation runs ten seconds in an instant: their events would be heard all at once.
TEST(SoundTimeline, SkipsASimulationThatRunsAheadUntilItKeepsToTime) {
  Player player;
  player.step();
  int heard = 0;
  for (int frame = 0; frame < 600; ++frame)
    heard += player.step(kTimelineStep, 1e-5) == TimelineStep::skipped ? 0 : 1;
  EXPECT_LE(heard * kTimelineStep, SoundTimeline::kMostAhead + 2.0 * kTimelineStep);
  int skipped = 0;
  while (player.step() == TimelineStep::skipped)
    ++skipped;
  EXPECT_LE(skipped * kTimelineStep, kLatency + 2.0 * kTimelineStep);
  EXPECT_NEAR(player.ahead(), kWhole, 0.5);
  EXPECT_EQ(player.step(), TimelineStep::steady);
}

TEST(SoundTimeline, InSlowMotionEventsAreFartherApart) {
  Player player;
  player.step();
  player.timeline.setScale(0.25);
  for (int frame = 0; frame < 2000; ++frame)
    ASSERT_EQ(player.step(0.25 * kTimelineStep, kTimelineStep), TimelineStep::steady);
  const double here = lookAhead(player.timeline, player.time, 0);
  const double later = lookAhead(player.timeline, player.time + 0.001, 0);
  EXPECT_NEAR(later - here, 0.004 * kRate, 0.006 * 0.004 * kRate);
  player.timeline.setScale(1.0);
  for (int frame = 0; frame < 2000; ++frame)
    ASSERT_EQ(player.step(), TimelineStep::steady);
  EXPECT_EQ(player.timeline.shiftAt(player.time).fraction, 0.0);
}

TEST(SoundTimeline, HasNoShiftForATimeThatNoClockHas) {
  SoundTimeline timeline(SoundClock::realTime, 48000.0, 0.05);
  timeline.setScale(1e-3);
  timeline.advance(1.0, 480);
  for (const double time : {std::nan(""), HUGE_VAL, -HUGE_VAL, 1e300, -1e18}) {
    const audio::SampleShift shift = timeline.shiftAt(time);
    EXPECT_EQ(shift.whole, 0);
    EXPECT_EQ(shift.fraction, 0.0);
  }
}

}  // namespace
}  // namespace carom
