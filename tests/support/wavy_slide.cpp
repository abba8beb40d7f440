#include "tests/support/wavy_slide.h"

#include <cmath>
#include <complex>
#include <cstdlib>
#include <numbers>
#include <span>

#include "tests/audio/ball_drop.h"

namespace carom::test {

std::shared_ptr<const SurfaceTexture> wavyFloor(float steepness) {
  std::vector<SurfaceTexture::Slope> slopes;
  for (std::size_t u = 0; u < 16; ++u)
    slopes.emplace_back(
        steepness * static_cast<float>(
                        std::cos(2.0 * std::numbers::pi * (static_cast<double>(u) + 0.5) / 16.0)),
        0.0F);
  return std::make_shared<const SurfaceTexture>(*SurfaceTexture::ofSlopes(
      {16, 1}, {WavySlide::kWave / 16.0, WavySlide::kWave / 16.0}, slopes));
}

void play(Synth& synth, const WavySlide& slide) {
  const auto steps = std::lround(WavySlide::kDuration / slide.step);
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
    synth.updateContact(state);
  }
}

std::vector<double> rendered(Synth& synth, std::size_t frames) {
  std::vector<double> samples(frames);
  double* const channel = samples.data();
  synth.render<double>(std::span(&channel, 1), frames);
  return samples;
}

Synth synthOf(const WavySlide& slide) {
  BallDrop drop;
  drop.radius = slide.radius;
  SynthSettings settings;
  settings.sampleRate = slide.sampleRate;
  settings.audibleThreshold = 0.0;
  Synth synth = *Synth::create(settings, {{"seat", slide.listener}});
  SoundBody floor = drop.floor();
  floor.texture = wavyFloor();
  if (!synth.setBody(kBall, drop.ball()) || !synth.setBody(kFloor, floor)) std::abort();
  return synth;
}

std::vector<double> soundOf(const WavySlide& slide) {
  Synth synth = synthOf(slide);
  play(synth, slide);
  return rendered(synth, static_cast<std::size_t>(WavySlide::kDuration * slide.sampleRate));
}

double amplitudeAt(const std::vector<double>& sound, double frequency) {
  std::complex<double> sum = 0.0;
  double weight = 0.0;
  const std::size_t from = sound.size() / 5;
  const std::size_t count = sound.size() * 3 / 5;
  for (std::size_t n = 0; n < count; ++n) {
    const double window = 1.0 - std::cos(2.0 * std::numbers::pi * static_cast<double>(n) /
                                         static_cast<double>(count));
    sum += window * sound[from + n] *
           std::polar(1.0, -2.0 * std::numbers::pi * frequency * static_cast<double>(n) /
                               WavySlide::kRate);
    weight += window;
  }
  return 2.0 * std::abs(sum) / weight;
}

double loudestFrequency(const std::vector<double>& sound, double low, double high) {
  double best = low;
  // A tone is 13 Hz wide in the window of amplitudeAt().
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

}  // namespace carom::test
