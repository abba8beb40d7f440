#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <memory>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "audio/surface_texture.h"
#include "audio/synth.h"
#include "tests/audio/ball_drop.h"
#include "tests/audio/ringing_box.h"
#include "tests/support/click_spectrum.h"

namespace carom::test {
namespace {

constexpr double kRate = 48000.0;
constexpr double kWave = 0.002;  // m, of the floor
constexpr float kSteepness = 0.02F;

std::shared_ptr<const SurfaceTexture> wavyFloor() {
  std::vector<SurfaceTexture::Slope> slopes;
  for (std::size_t u = 0; u < 16; ++u)
    slopes.emplace_back(
        kSteepness * static_cast<float>(
                         std::cos(2.0 * std::numbers::pi * (static_cast<double>(u) + 0.5) / 16.0)),
        0.0F);
  return std::make_shared<const SurfaceTexture>(
      *SurfaceTexture::ofSlopes({16, 1}, {kWave / 16.0, kWave / 16.0}, slopes));
}

/// A steel ball that slides over a wavy floor along x, pressed down by `load`, for half a second.
struct Slide {
  double speed = 1.0;         // m/s
  double load = 5.0;          // N: it follows the floor
  double step = 1.0 / 240.0;  // s
  double sampleRate = kRate;
  double radius = 0.005;  // m
  Vec3 listener = {0.25, 3.0, 1.0};
};

constexpr double kDuration = 0.5;

void play(Synth& synth, const Slide& slide) {
  const auto steps = std::lround(kDuration / slide.step);
  for (long index = 0; index < steps; ++index) {
    ContactState state;
    state.time = static_cast<double>(index) * slide.step;
    state.duration = slide.step;
    state.phase = index == 0 ? ContactPhase::begin : ContactPhase::during;
    state.body = kBall;
    state.other = kFloor;
    state.normal = Vec3::UnitZ();
    state.position = {slide.speed * state.time, 0.0, 0.0};
    state.normalLoad = slide.load;
    state.appliedImpulse = slide.load * slide.step * Vec3::UnitZ();
    state.slipVelocity = slide.speed * Vec3::UnitX();
    state.rollingVelocity = 0.5 * slide.speed * Vec3::UnitX();
    state.bodyPosition = state.position + slide.radius * Vec3::UnitZ();
    state.bodyVelocity = slide.speed * Vec3::UnitX();
    state.pathStart = state.pathEnd = -slide.radius * Vec3::UnitZ();
    state.otherPathStart = state.position;
    state.otherPathEnd = state.position + slide.speed * slide.step * Vec3::UnitX();
    synth.touch(state);
  }
}

std::vector<double> rendered(Synth& synth, std::size_t frames) {
  std::vector<double> samples(frames);
  double* const channel = samples.data();
  synth.render<double>(std::span(&channel, 1), frames);
  return samples;
}

Synth synthOf(const Slide& slide) {
  BallDrop drop;
  drop.radius = slide.radius;
  SynthSettings settings;
  settings.sampleRate = slide.sampleRate;
  settings.audibleThreshold = 0.0;
  Synth synth = *Synth::create(settings, {{"seat", slide.listener}});
  SoundBody floor = drop.floor();
  floor.texture = wavyFloor();
  EXPECT_TRUE(synth.setBody(kBall, drop.ball()));
  EXPECT_TRUE(synth.setBody(kFloor, floor));
  return synth;
}

std::vector<double> soundOf(const Slide& slide) {
  Synth synth = synthOf(slide);
  play(synth, slide);
  return rendered(synth, static_cast<std::size_t>(kDuration * slide.sampleRate));
}

/// Of the middle of the sound, with a Hann window: Pa, amplitude of a tone at that frequency.
double amplitudeAt(const std::vector<double>& sound, double frequency) {
  std::complex<double> sum = 0.0;
  double weight = 0.0;
  const std::size_t from = sound.size() / 5;
  const std::size_t count = sound.size() * 3 / 5;
  for (std::size_t n = 0; n < count; ++n) {
    const double window = 1.0 - std::cos(2.0 * std::numbers::pi * static_cast<double>(n) /
                                         static_cast<double>(count));
    sum += window * sound[from + n] *
           std::polar(1.0, -2.0 * std::numbers::pi * frequency * static_cast<double>(n) / kRate);
    weight += window;
  }
  return 2.0 * std::abs(sum) / weight;
}

double loudestFrequency(const std::vector<double>& sound, double low, double high) {
  double best = low;
  // A tone is 13 Hz wide in that window.
  for (const double step : {4.0, 0.1}) {
    double most = 0.0;
    const double begin = step == 4.0 ? low : best - 4.0;
    const double end = step == 4.0 ? high : best + 4.0;
    for (double frequency = begin; frequency <= end; frequency += step) {
      const double amplitude = amplitudeAt(sound, frequency);
      if (amplitude <= most) continue;
      most = amplitude;
      best = frequency;
    }
  }
  return best;
}

double rms(const std::vector<double>& samples) {
  double sum = 0.0;
  for (const double sample : samples)
    sum += sample * sample;
  return std::sqrt(sum / static_cast<double>(samples.size()));
}

TEST(SynthSlide, SoundsAtSpeedOverWavelength) {
  for (const double speed : {0.5, 1.0, 2.0}) {
    const std::vector<double> sound = soundOf({.speed = speed});
    const double heard = loudestFrequency(sound, 100.0, 4000.0);
    EXPECT_NEAR(heard, speed / kWave, 0.005 * speed / kWave);
  }
}

// p = rho a^3 / (2 c r) w^2 v s cos(elevation), of a small sphere that a force m v s w moves.
TEST(SynthSlide, IsAsLoudAsTheBallThatFollowsTheFloor) {
  for (const double speed : {0.5, 1.0, 2.0}) {
    const Slide slide{.speed = speed};
    const double frequency = speed / kWave;
    const double w = 2.0 * std::numbers::pi * frequency;
    const Vec3 way = slide.listener - Vec3(0.25, 0.0, slide.radius);
    const double a = slide.radius;
    const double expected = 1.20 * a * a * a / (2.0 * 343.0 * way.norm()) * w * w * speed *
                            static_cast<double>(kSteepness) * way.z() / way.norm();
    // Near field and size: (k r)^2 is over 700, (k a)^2 below 0.01; the floor's 16 texels to a wave
    // are averaged by the spline to 0.981 of its slope.
    EXPECT_NEAR(amplitudeAt(soundOf(slide), frequency), expected * 0.981, 0.03 * expected);
  }
}

TEST(SynthSlide, SoundsAlikeAtAnyStepOfTheMechanics) {
  const std::vector<double> reference = soundOf({.step = 1.0 / 1000.0});
  for (const double step : {1.0 / 60.0, 1.0 / 240.0}) {
    const std::vector<double> sound = soundOf({.step = step});
    std::vector<double> difference;
    for (std::size_t n = 0; n < sound.size(); ++n)
      difference.push_back(sound[n] - reference[n]);
    EXPECT_LT(rms(difference), 0.01 * rms(reference)) << step;
  }
}

TEST(SynthSlide, AtRestThereIsSilence) {
  EXPECT_EQ(rms(soundOf({.speed = 0.0})), 0.0);
}

// The floor's mode is driven by the other sign of the same train: where the floor's waves come at
// its frequency it is far louder than beside it.
TEST(SynthSlide, DrivesTheModesOfWhatIsSlidOn) {
  const auto level = [](double speed) {
    const Slide slide{.speed = speed};
    Synth synth = synthOf(slide);
    SoundBody floor = BallDrop().floor();
    floor.texture = wavyFloor();
    floor.modal = boxOf({{.frequency = 500.0, .decayRate = 10.0}});
    EXPECT_TRUE(synth.setBody(kFloor, floor));
    play(synth, slide);
    return rms(rendered(synth, static_cast<std::size_t>(kDuration * kRate)));
  };
  EXPECT_GT(level(1.0), 10.0 * level(1.3));
}

TEST(SynthSlide, BitsDoNotDependOnTheBlocks) {
  const Slide slide{.speed = 1.0, .load = 0.05};
  Synth whole = synthOf(slide);
  play(whole, slide);
  const std::vector<double> expected = rendered(whole, 12000);
  Synth parts = synthOf(slide);
  play(parts, slide);
  std::vector<double> sound;
  for (std::size_t frames = 1; sound.size() < expected.size(); frames = frames * 3 % 509 + 1) {
    const auto part = rendered(parts, std::min(frames, expected.size() - sound.size()));
    sound.insert(sound.end(), part.begin(), part.end());
  }
  EXPECT_EQ(sound, expected);
  EXPECT_GT(rms(sound), 0.0);
}

}  // namespace
}  // namespace carom::test
