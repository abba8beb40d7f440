// Tests the estimate of how loud what rings gets, by which exposure is chosen, against the samples.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "audio/propagation/sound_paths.h"
#include "audio/scheduling/contact_sound_scheduler.h"
#include "carom/audio/synth.h"
#include "tests/audio/ball_drop.h"
#include "tests/audio/ringing_box.h"

namespace carom::test {
namespace {

struct LoudestRing final : audio::SoundSink {
  double peak = 0.0;
  void add(const audio::ScheduledSound& sound) override { peak = std::max(peak, sound.modalPeak); }
};

double estimated(const BallDrop& drop, const SoundBody& floor, const SynthSettings& settings,
                 const Listener& listener) {
  audio::ContactSoundScheduler scheduler(*audio::makeSoundPaths(settings, {listener}));
  EXPECT_TRUE(scheduler.setBody(kBall, {.material = drop.material}));
  EXPECT_TRUE(scheduler.setBody(kFloor, floor));
  LoudestRing sink;
  scheduler.schedule(floorShare(drop), {}, sink);
  return sink.peak;
}

double rendered(const BallDrop& drop, const SoundBody& floor, const SynthSettings& settings,
                const Listener& listener) {
  Synth synth = *Synth::create(settings, {listener});
  EXPECT_TRUE(synth.setBody(kBall, {.material = drop.material}));  // its click is left out
  EXPECT_TRUE(synth.setBody(kFloor, floor));
  synth.schedule(floorShare(drop));
  return peakOf(renderMono(synth, 9600));
}

}  // namespace

TEST(RingLoudness, IsThatOfTheSamples) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  double sum = 0.0;
  double loudest = -1e9;
  double quietest = 1e9;
  constexpr int kBlows = 60;
  for (int blow = 0; blow < kBlows; ++blow) {
    std::vector<Tone> tones(1 + static_cast<std::size_t>(24.0 * share(random)));
    for (Tone& tone : tones)
      tone = {.frequency = 200.0 * std::pow(60.0, share(random)),
              .decayRate = 5.0 + 50.0 * share(random),
              .volume = 1e-3 * (share(random) - 0.5)};
    std::ranges::sort(tones, {}, &Tone::frequency);
    BallDrop drop = dropOnBox(0.01);
    drop.speed = 0.02 * std::pow(200.0, share(random));
    SoundBody floor = drop.floor();
    floor.modal = boxOf(tones);
    SynthSettings settings;
    settings.ringingContact = blow % 2 == 0 ? RingingContact::coupled : RingingContact::pressed;
    const Listener listener{"seat", {0.3, 0.2, 1.0}};
    const double error = 20.0 * std::log10(estimated(drop, floor, settings, listener) /
                                           rendered(drop, floor, settings, listener));
    loudest = std::max(loudest, error);
    quietest = std::min(quietest, error);
    sum += error / kBlows;
  }
  // Phases are not known, so that single blows are off by what a few modes may add up to.
  EXPECT_NEAR(sum, 0.0, 2.0);
  EXPECT_LT(loudest, 12.0);
  EXPECT_GT(quietest, -12.0);
}

}  // namespace carom::test
