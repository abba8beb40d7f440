#include "audio/synthesis/click_renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "audio/scheduling/contact_sound_scheduler.h"
#include "carom/audio/synth.h"
#include "tests/audio/ball_drop.h"
#include "tests/support/no_alloc_scope.h"
#include "tests/support/random.h"

// Tests of ClickRenderer with a capacity, as it runs on an audio thread. Without a capacity it is
// half of Synth, whose tests cover it.

namespace carom {

using namespace audio;

namespace {

using test::BallDrop;
using Planes = std::vector<std::vector<double>>;

constexpr std::size_t kPlayedFrames = 12000;
constexpr BodyId kPlayedFloor = 1000;

SoundBody ballOf(BodyId id) {
  return BallDrop{.radius = 0.004 * std::pow(1.03, id)}.ball();
}

/// The impact of ball `id` on the floor at `speed` (m/s).
ImpulseEvent dropOf(BodyId id, double time, double speed) {
  const SoundBody ball = ballOf(id);
  ImpulseEvent event = BallDrop{.radius = ball.radius, .speed = speed, .time = time}.event();
  event.body = id;
  event.other = kPlayedFloor;
  return event;
}

std::vector<Listener> pair() {
  Listener pair{"pair", {0.1, 0.2, 1.0}};
  pair.format = ListenerFormat::spacedPair;
  return {pair};
}

/// A room, so that there are several paths and a tail.
SynthSettings roomSettings() {
  SynthSettings settings;
  const Absorption tiles{{0.05, 0.1, 0.1, 0.2, 0.3, 0.4, 0.4}};
  settings.room.reflectors = {{Vec3::UnitX(), -4.0, tiles}, {-Vec3::UnitX(), -5.0, tiles},
                              {Vec3::UnitY(), -3.0, tiles}, {-Vec3::UnitY(), -3.0, tiles},
                              {Vec3::UnitZ(), -1.0, {}},    {-Vec3::UnitZ(), -2.5, tiles}};
  settings.reverb = *reverbOfBox(settings.room, 343.0);
  return settings;
}

/// The two halves of a synth, of which the renderer has a capacity.
struct Stage {
  std::shared_ptr<const SoundPaths> paths;
  ContactSoundScheduler scheduler;
  ClickRenderer renderer;

  explicit Stage(const SynthSettings& settings, const RendererCapacity& capacity = {})
      : paths(*makeSoundPaths(settings, pair())), scheduler(paths), renderer(paths, capacity) {
    for (BodyId id = 0; id < 60; ++id)
      EXPECT_TRUE(scheduler.setBody(id, ballOf(id)));
    EXPECT_TRUE(scheduler.setBody(kPlayedFloor, BallDrop{}.floor()));
  }

  void add(const ImpulseEvent& event) { scheduler.schedule(event, {}, renderer); }

  Planes render(std::size_t frames, std::size_t block = 64) {
    Planes planes(paths->channels.size(), std::vector<double>(frames));
    for (std::size_t done = 0; done < frames; done += block) {
      std::vector<double*> to;
      for (std::vector<double>& plane : planes)
        to.push_back(plane.data() + done);
      renderer.render<double>(to, std::min(block, frames - done));
    }
    return planes;
  }
};

/// Keeps the clicks of sounds.
struct KeptSounds final : SoundSink {
  std::vector<std::pair<double, std::vector<Click>>> sounds;

  void add(const ScheduledSound& sound) override {
    sounds.emplace_back(sound.peak, std::vector<Click>(sound.clicks.begin(), sound.clicks.end()));
  }
};

/// Renders all the events with a synth, which leaves nothing out.
Planes offline(const SynthSettings& settings, const std::vector<ImpulseEvent>& events,
               std::size_t frames = kPlayedFrames) {
  Synth synth = *Synth::create(settings, pair());
  for (BodyId id = 0; id < 60; ++id)
    EXPECT_TRUE(synth.setBody(id, ballOf(id)));
  EXPECT_TRUE(synth.setBody(kPlayedFloor, BallDrop{}.floor()));
  for (const ImpulseEvent& event : events)
    synth.schedule(event);
  return test::renderPlanes<double>(synth, frames);
}

std::vector<ImpulseEvent> someEvents(int count) {
  Random random(7);
  std::vector<ImpulseEvent> events;
  events.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i)
    events.push_back(dropOf(static_cast<BodyId>(random.below(60)), random.between(0.01, 0.2),
                            random.logBetween(0.02, 2.0)));
  return events;
}

TEST(ClickRendererWithACapacity, PlaysTheBitsOfOneWithout) {
  for (const SynthSettings& settings : {SynthSettings{}, roomSettings()}) {
    const std::vector<ImpulseEvent> events = someEvents(200);
    const Planes wanted = offline(settings, events);
    for (const std::size_t block : {64U, 100U, 256U, 1024U}) {
      Stage stage(settings, {.buses = 4096});
      for (const ImpulseEvent& event : events)
        stage.add(event);
      EXPECT_TRUE(stage.render(kPlayedFrames, block) == wanted) << block;
      EXPECT_EQ(stage.renderer.counters().late, 0U);
      EXPECT_EQ(stage.renderer.voices(), 0U);
    }
  }
}

TEST(ClickRendererWithACapacity, AllocatesNothingOnceItIsMade) {
  for (const SynthSettings& settings : {SynthSettings{}, roomSettings()}) {
    Stage stage(settings, {.voices = 50, .buses = 200});
    KeptSounds kept;
    for (const ImpulseEvent& event : someEvents(300))
      stage.scheduler.schedule(event, {}, kept);
    Planes planes(2, std::vector<double>(64));
    const std::vector<double*> to = {planes[0].data(), planes[1].data()};
    std::size_t next = 0;
    const test::NoAllocScope scope;
    for (int block = 0; block < 400; ++block) {
      for (int i = 0; i < 3 && next < kept.sounds.size(); ++i, ++next)
        stage.renderer.add({.peak = kept.sounds[next].first, .clicks = kept.sounds[next].second});
      stage.renderer.render<double>(to, 64);
    }
    EXPECT_EQ(scope.allocations(), 0U);
    EXPECT_GT(stage.renderer.counters().stolen + stage.renderer.counters().late, 0U);
  }
}

// Balls of one size at one place, whose loudness grows with their speed.
std::vector<ImpulseEvent> ofRisingLoudness(int count, double time, double apart = 0.0) {
  std::vector<ImpulseEvent> events;
  events.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i)
    events.push_back(dropOf(5, time + apart * i, 0.1 * std::pow(1.05, i)));
  return events;
}

TEST(ClickRendererWithACapacity, LeavesTheQuietestOutWhereThereAreTooManyVoices) {
  std::vector<ImpulseEvent> events = ofRisingLoudness(20, 0.05, 1e-3);
  const Planes loudest = offline({}, {events.begin() + 12, events.end()});
  Random random(1);
  for (int order = 0; order < 10; ++order) {
    Stage stage({}, {.voices = 8});
    for (std::size_t i = events.size(); i > 1; --i)
      std::swap(events[i - 1], events[static_cast<std::size_t>(random.below(static_cast<int>(i)))]);
    for (const ImpulseEvent& event : events)
      stage.add(event);
    EXPECT_TRUE(stage.render(kPlayedFrames) == loudest);
    EXPECT_EQ(stage.renderer.counters().stolen, 12U);
  }
}

TEST(ClickRendererWithACapacity, DoesNotCutWhatHasBegun) {
  Stage stage({}, {.voices = 1});
  // The near ear has heard the quiet click begin, the far one has not.
  const ImpulseEvent quiet = dropOf(5, 0.0, 0.1);
  const ImpulseEvent loud = dropOf(6, 0.02, 2.0);
  stage.add(quiet);
  std::size_t before = 0;
  while (stage.renderer.pendingClicks() == 2) {
    stage.render(1, 1);
    ++before;
  }
  ASSERT_EQ(stage.renderer.pendingClicks(), 1U);
  stage.add(loud);  // finds no voice that it could take
  EXPECT_EQ(stage.renderer.counters().stolen, 1U);
  const Planes rest = stage.render(kPlayedFrames - before);
  const Planes wanted = offline({}, {quiet});
  for (std::size_t channel = 0; channel < 2; ++channel)
    EXPECT_TRUE(std::equal(rest[channel].begin(), rest[channel].end(),
                           wanted[channel].begin() + static_cast<std::ptrdiff_t>(before)));
}

TEST(ClickRendererWithACapacity, TakesTheLoudestThatItCanAfford) {
  const std::vector<ImpulseEvent> events = ofRisingLoudness(100, 0.05);
  std::size_t last = 0;
  for (const double allowance : {1.5e7, 6e6, 3e6}) {
    Stage stage({});
    stage.renderer.setAllowance(allowance);
    for (const ImpulseEvent& event : events)
      stage.add(event);
    const Planes heard = stage.render(kPlayedFrames);
    const std::size_t left = stage.renderer.counters().overBudget;
    EXPECT_GT(left, last) << allowance;  // less is afforded
    ASSERT_LT(left, events.size());
    const auto first = events.begin() + static_cast<std::ptrdiff_t>(left);
    EXPECT_TRUE(heard == offline({}, {first, events.end()})) << allowance;
    last = left;
  }
}

TEST(ClickRendererWithACapacity, WithoutMoneyItIsSilentAndRecovers) {
  Stage stage({});
  stage.renderer.setAllowance(1.0);
  for (const ImpulseEvent& event : ofRisingLoudness(50, 0.01))
    stage.add(event);
  for (const std::vector<double>& plane : stage.render(4800))
    EXPECT_TRUE(std::ranges::all_of(plane, [](double p) { return p == 0.0; }));
  EXPECT_EQ(stage.renderer.counters().overBudget, 50U);
  EXPECT_EQ(stage.renderer.voices(), 0U);
  stage.renderer.setAllowance(std::numeric_limits<double>::infinity());
  const ImpulseEvent after = dropOf(5, 0.15, 1.0);
  stage.add(after);
  const Planes heard = stage.render(kPlayedFrames - 4800);
  const Planes wanted = offline({}, {after});
  EXPECT_TRUE(std::equal(heard[0].begin(), heard[0].end(), wanted[0].begin() + 4800));
}

// A late event begins in its middle offline, which is a step; the renderer shifts it and plays it
// whole.
TEST(ClickRendererWithACapacity, LateEventsAreHeardWholeAndLater) {
  Stage stage({});
  stage.render(4000);
  const ImpulseEvent late = dropOf(5, 0.01, 1.0);
  stage.add(late);
  EXPECT_EQ(stage.renderer.counters().late, 1U);
  const Planes heard = stage.render(2000);
  const Planes wanted = offline({}, {late});
  // Both are compared sample by sample from their onsets: the first nonzero sample at either ear.
  const auto isSound = [](double p) { return p != 0.0; };
  const auto onset = [&](const Planes& planes) {
    std::ptrdiff_t first = std::numeric_limits<std::ptrdiff_t>::max();
    for (const std::vector<double>& plane : planes)
      first = std::min(first, std::ranges::find_if(plane, isSound) - plane.begin());
    return first;
  };
  EXPECT_LT(onset(heard), 64);  // within the filter's own rise
  for (std::size_t channel = 0; channel < 2; ++channel)
    EXPECT_TRUE(std::equal(heard[channel].begin() + onset(heard), heard[channel].begin() + 1000,
                           wanted[channel].begin() + onset(wanted)));
}

TEST(ClickRendererWithACapacity, LeavesOutWhatItHasNoBusForAndWhatIsTooLong) {
  Stage stage({}, {.buses = 2});  // two channels of one size
  const ImpulseEvent first = dropOf(5, 0.05, 1.0);
  stage.add(first);
  stage.add(dropOf(6, 0.05, 2.0));
  EXPECT_EQ(stage.renderer.counters().noBus, 1U);
  EXPECT_TRUE(stage.render(kPlayedFrames) == offline({}, {first}));
  stage.add(dropOf(6, 0.3, 2.0));  // the buses of `first` are idle by now
  EXPECT_EQ(stage.renderer.counters().noBus, 1U);

  Stage brief({}, {.longestContact = 1e-3});
  brief.add(first);
  EXPECT_EQ(brief.renderer.counters().tooLong, 0U);
  EXPECT_TRUE(brief.scheduler.setBody(7, BallDrop{.material = *findMaterial("rubber")}.ball()));
  const ImpulseEvent soft = dropOf(7, 0.05, 0.1);
  ASSERT_GT(brief.scheduler.contactDuration(soft), 2.5e-3);
  brief.add(soft);
  EXPECT_EQ(brief.renderer.counters().tooLong, 1U);
  EXPECT_EQ(brief.renderer.voices(), 1U);
}

}  // namespace
}  // namespace carom
