// What is no number, or could be no sound, costs its own instant and nothing after it.

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "audio/scheduling/contact_sound_scheduler.h"
#include "audio/synthesis/click_renderer.h"
#include "tests/audio/ball_drop.h"
#include "tests/audio/ringing_box.h"
#include "tests/support/wavy_slide.h"

namespace carom::audio {
namespace {

using test::BallDrop;
using test::kBall;
using test::kFloor;

constexpr std::size_t kFrames = 24000;
const double kNaN = std::nan("");

/// Scheduler and renderer of a ball that falls on a box that rings, with a room and its tail.
struct Hall {
  explicit Hall(const std::optional<RendererCapacity>& capacity = std::nullopt)
      : paths(*makeSoundPaths(settings(), {{"ear", {0.1, 0.2, 0.9}}})),
        scheduler(paths),
        renderer(paths, capacity) {
    SoundBody box = BallDrop{}.floor();
    box.modal = test::boxOf({{700.0, 8.0}, {2100.0, 30.0}});
    EXPECT_TRUE(scheduler.setBody(kBall, test::dropOnBox(0.0).ball()));
    EXPECT_TRUE(scheduler.setBody(kFloor, box));
  }
  static SynthSettings settings() {
    SynthSettings settings;
    const Absorption tiles{{0.05, 0.1, 0.1, 0.2, 0.3, 0.4, 0.4}};
    settings.room.reflectors = {{Vec3::UnitX(), -4.0, tiles}, {-Vec3::UnitX(), -5.0, tiles},
                                {Vec3::UnitY(), -3.0, tiles}, {-Vec3::UnitY(), -3.0, tiles},
                                {Vec3::UnitZ(), -1.0, tiles}, {-Vec3::UnitZ(), -2.5, tiles}};
    settings.reverb = *reverbOfBox(settings.room, 343.0);
    return settings;
  }

  /// Both shares of an impact at `time`.
  void strike(double time, SoundSink& sink) {
    const BallDrop drop = test::dropOnBox(time);
    scheduler.schedule(drop.event(), {}, sink);
    scheduler.schedule(test::floorShare(drop), {}, sink);
  }
  std::vector<double> render(std::size_t frames) {
    std::vector<double> samples(frames);
    double* const channel = samples.data();
    renderer.render<double>({&channel, 1}, frames);
    return samples;
  }

  std::shared_ptr<const SoundPaths> paths;
  ContactSoundScheduler scheduler;
  ClickRenderer renderer;
};

/// Hands on sounds with a number that is none: of clicks the gain, of excitations a tap.
struct Spoiler final : SoundSink {
  Spoiler(ClickRenderer& renderer, double number) : to(renderer), bad(number) {}
  void add(const ScheduledSound& sound) override {
    std::vector<Click> clicks(sound.clicks.begin(), sound.clicks.end());
    for (Click& click : clicks)
      click.track.gain = bad;
    std::vector<double> taps(sound.taps.begin(), sound.taps.end());
    for (const ModalExcitation& excitation : sound.excitations)
      taps[excitation.taps] = bad;
    ScheduledSound spoilt = sound;
    spoilt.clicks = clicks;
    spoilt.taps = taps;
    to.add(spoilt);
  }
  ClickRenderer& to;
  double bad;
};

TEST(NotFinite, WithinRenderingCostsItsOwnInstant) {
  const double infinite = std::numeric_limits<double>::infinity();
  for (const bool isLimited : {false, true}) {
    const auto capacity = isLimited ? std::optional<RendererCapacity>(std::in_place) : std::nullopt;
    Hall whole(capacity);
    whole.strike(0.02, whole.renderer);
    whole.strike(0.3, whole.renderer);
    const std::vector<double> right = whole.render(kFrames);
    EXPECT_EQ(whole.renderer.counters().silencedFrames, 0u);
    for (const double bad : {kNaN, infinite, -infinite, 1e300}) {
      Hall spoilt(capacity);
      spoilt.strike(0.02, spoilt.renderer);
      spoilt.strike(0.3, spoilt.renderer);
      Spoiler spoiler(spoilt.renderer, bad);
      spoilt.strike(0.1, spoiler);
      const std::vector<double> heard = spoilt.render(kFrames);
      EXPECT_GT(spoilt.renderer.counters().silencedFrames, 0u);
      EXPECT_EQ(spoilt.renderer.counters().lost, 2u);
      EXPECT_EQ(spoilt.renderer.counters().heard, 4u);
      EXPECT_TRUE(heard == right) << bad;
    }
  }
}

TEST(NotFinite, NoiseCostsItsOwnInstant) {
  SynthSettings settings;
  settings.lasting = LastingDetail::heard;
  ClickRenderer renderer(*makeSoundPaths(settings, {{"ear", {0.1, 0.2, 0.9}}}));
  std::vector<float> powers(kThirdOctaves, 1e-4F);
  powers[10] = std::numeric_limits<float>::quiet_NaN();
  renderer.add({.noise = {.at = 1000, .since = 500, .lasting = 400, .powers = powers}});
  powers[10] = 1e-4F;
  renderer.add({.noise = {.at = 4000, .since = 3000, .lasting = 4000, .powers = powers}});
  std::vector<double> samples(2048);
  double* const channel = samples.data();
  renderer.render<double>({&channel, 1}, samples.size());
  EXPECT_GT(renderer.counters().silencedFrames, 0u);
  renderer.add({.noise = {.at = 6000, .since = 3000, .lasting = 4000, .powers = powers}});
  double power = 0.0;
  for (int block = 0; block < 4; ++block) {
    for (const double sample : samples) {
      ASSERT_TRUE(std::isfinite(sample));
      power += sample * sample;
    }
    renderer.render<double>({&channel, 1}, samples.size());
  }
  EXPECT_GT(power, 0.0) << "what comes later is heard";
}

/// Schedules an event between two impacts; true if that changes nothing but the counters.
void expectRefused(const ImpulseEvent& bad, std::uint64_t SynthCounters::*reason,
                   const std::string& what) {
  Hall without;
  without.strike(0.02, without.renderer);
  without.strike(0.3, without.renderer);
  Hall with;
  with.strike(0.02, with.renderer);
  with.scheduler.schedule(bad, {}, with.renderer);
  with.strike(0.3, with.renderer);
  EXPECT_EQ(with.scheduler.counters().rejected, 1u) << what;
  EXPECT_EQ(with.scheduler.counters().*reason, 1u) << what;
  EXPECT_TRUE(with.render(kFrames) == without.render(kFrames)) << what;
}

TEST(NotFinite, AndHugeEventsAreRefusedWithAReason) {
  for (const bool rings : {false, true}) {
    const BallDrop drop = test::dropOnBox(0.1);
    const ImpulseEvent good = rings ? test::floorShare(drop) : drop.event();
    for (const double huge : {1e20, 1e45, 1e160, 1e300}) {
      ImpulseEvent event = good;
      event.impulse *= huge;
      expectRefused(event, &SynthCounters::rejectedTooFar, "impulse " + std::to_string(huge));
      event = good;
      event.bodyOrientation.coeffs() *= huge;
      expectRefused(event, &SynthCounters::rejectedNotFinite, "turn " + std::to_string(huge));
    }
    ImpulseEvent event = good;
    event.bodyOrientation.coeffs().setZero();
    expectRefused(event, &SynthCounters::rejectedNotFinite, "no turn");
    event = good;
    event.impulse.y() = kNaN;
    expectRefused(event, &SynthCounters::rejectedNotFinite, "impulse");
    event = good;
    event.time = kNaN;
    expectRefused(event, &SynthCounters::rejectedNotFinite, "time");
  }
}

// The listener is farther away than samples can count.
TEST(NotFinite, StepsOfContactsAreNoRejectedEvents) {
  const test::WavySlide slide{.listener = {0.25, 1e17, 1.0}};
  Synth synth = test::synthOf(slide);
  test::play(synth, slide);
  EXPECT_GT(synth.counters().rejectedSlides, 0u);
  EXPECT_EQ(synth.counters().rejected, 0u);
  EXPECT_EQ(synth.counters().events, 0u);
}

}  // namespace
}  // namespace carom::audio
