// Stiff and extreme cases of sliding and rolling contacts.

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "lab/stability/stability_cases.h"
#include "lab/stability/stability_sources.h"

#include "carom/audio/synth.h"

namespace carom::lab {

namespace {

using Measurements = std::vector<Measurement>;

constexpr double kPi = std::numbers::pi;
Synth synthOf(const Slide& slide) {
  SynthSettings settings;
  settings.sampleRate = slide.sampleRate;
  settings.audibleThreshold = 0.0;
  settings.doppler = false;
  settings.airAbsorption = false;  // the references have none
  const Vec3 seat(0.5 * slide.length(), 0.0, slide.distance);
  Synth synth = orThrow(Synth::create(settings, {{.name = "seat", .position = seat}}));
  setBodies(synth, slide);
  orThrow(synth.seek(slide.begin));
  return synth;
}

std::vector<double> soundOf(const Slide& slide) {
  Synth synth = synthOf(slide);
  for (const ContactState& state : statesOf(slide))
    synth.updateContact(state);
  return rendered(synth, static_cast<std::size_t>(slide.duration * slide.sampleRate));
}

double peakOf(const std::vector<double>& samples) {
  Worst largest;
  for (const double sample : samples)
    largest.add(std::abs(sample));
  return largest.value();
}

/// Returns the amplitude of a tone in the middle of the sound, Pa.
double amplitudeAt(const std::vector<double>& sound, double sampleRate, double frequency) {
  const std::size_t from = sound.size() / 5;
  const std::size_t count = sound.size() * 3 / 5;
  std::complex<double> sum = 0.0;
  double weight = 0.0;
  for (std::size_t sample = 0; sample < count; ++sample) {
    const double window =
        1.0 - std::cos(2.0 * kPi * static_cast<double>(sample) / static_cast<double>(count));
    sum += window * sound[from + sample] *
           std::polar(1.0, -2.0 * kPi * frequency * static_cast<double>(sample) / sampleRate);
    weight += window;
  }
  return 2.0 * std::abs(sum) / weight;
}

// Expected amplitude in Pa. The ball follows z = A sin(2 pi x / wave), whose largest slope is s: at
// the speed v its acceleration is 2 pi v^2 s / wave. The far field of this dipole is that times w
// rho a^3 / (2 c r); `near` replaces w to include the near field.
double wantedAmplitude(const Slide& slide) {
  const double w = 2.0 * kPi * slide.speed / kWaveLength;
  const double acceleration = w * slide.speed * static_cast<double>(kWaveSteepness);
  const double a = slide.radius;
  const double near = std::hypot(w, 343.0 / slide.distance);
  return 1.20 * a * a * a / (2.0 * 343.0 * slide.distance) * near * acceleration;
}

constexpr double kTone = 1.0 / kWaveLength;  // Hz, at 1 m/s

Measurements rates(StabilityForm /*form*/) {
  Worst level;
  Worst theory;
  const Slide finest{.sampleRate = 192000.0};
  const double reference = amplitudeAt(soundOf(finest), 192000.0, kTone);
  for (const double rate : {8000.0, 16000.0, 44100.0, 48000.0, 96000.0, 192000.0}) {
    const double amplitude = amplitudeAt(soundOf({.sampleRate = rate}), rate, kTone);
    level.add(std::abs(20.0 * std::log10(amplitude / reference)));
    theory.add(std::abs(20.0 * std::log10(amplitude / wantedAmplitude(finest))));
  }
  return {atMost("tone_beside_192_kHz", level.value(), 0.1, "dB"),
          atMost("tone_beside_a_ball_that_follows_the_waves", theory.value(), 1.0, "dB")};
}

Measurements afterADay(StabilityForm /*form*/) {
  const Slide slide{};
  const Slide late{.begin = 86400.0};
  const double first = amplitudeAt(soundOf(slide), 48000.0, kTone);
  const double second = amplitudeAt(soundOf(late), 48000.0, kTone);
  return {nearly("tone_beside_the_first_day", second / first, 1.0, 1e-3)};
}

// Speeds that are too low for sliding, and too high.
Measurements speeds(StabilityForm /*form*/) {
  Worst slow;
  for (const double speed : {0.0, 1e-9, 1e-6, 4e-4})
    slow.add(peakOf(soundOf({.speed = speed})));
  Worst fast;
  for (const double speed : {2e3, 1e4, 1e9})
    fast.add(peakOf(soundOf({.speed = speed})));
  // Slower than ContactDrive::kSlowest is rest, and faster
  // than kFastest is a jump: both are silent.
  return {exactly("peak_below_1_mm/s", slow.value(), 0.0, "Pa"),
          exactly("peak_above_1_km/s", fast.value(), 0.0, "Pa")};
}

Measurements everything(StabilityForm form) {
  double odd = 0.0;
  double heard = 0.0;
  const std::vector<double> sampleRates = form == StabilityForm::full
                                              ? std::vector<double>{8000.0, 48000.0, 192000.0}
                                              : std::vector<double>{48000.0};
  for (const double rate : sampleRates)
    for (const double modulus : {1e5, 1.2e12})
      for (const double radius : {1e-5, 1e-2, 10.0})
        for (const double speed : {1e-9, 1e-2, 1.0, 100.0, 1e4})
          for (const double load : {0.0, 1e-9, 1.0, 1e9})
            for (const double distance : {1e-3, 1e4}) {
              const Slide slide{.sampleRate = rate,
                                .radius = radius,
                                .modulus = modulus,
                                .speed = speed,
                                .load = load,
                                .duration = 0.025,
                                .distance = distance};
              heard += 1.0;
              if (!std::isfinite(peakOf(soundOf(slide)))) odd += 1.0;
            }
  return {atLeast("slides", heard, 200.0), exactly("not_finite", odd, 0.0)};
}

Measurements nonsense(StabilityForm /*form*/) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinite = std::numeric_limits<double>::infinity();
  double odd = 0.0;
  const auto hear = [&odd](auto change) {
    const Slide slide{.duration = 0.05};
    Synth synth = synthOf(slide);
    for (int step = 0; step < 12; ++step) {
      ContactState state = slide.stateAt(step * slide.step);
      if (step > 2) change(state);
      synth.updateContact(state);
    }
    if (!std::isfinite(peakOf(rendered(synth, 4800)))) odd += 1.0;
  };
  for (const double value : {nan, infinite, -infinite, -1.0, 1e300}) {
    hear([value](ContactState& state) { state.time = value; });
    hear([value](ContactState& state) { state.duration = value; });
    hear([value](ContactState& state) { state.normalLoad = value; });
    hear([value](ContactState& state) { state.position.x() = value; });
    hear([value](ContactState& state) { state.slipVelocity.x() = value; });
    hear([value](ContactState& state) { state.rollingVelocity.x() = value; });
    hear([value](ContactState& state) { state.otherPathEnd.x() = value; });
    hear([value](ContactState& state) { state.radius = value; });
    hear([value](ContactState& state) { state.normal.x() = value; });
    hear([value](ContactState& state) { state.bodyPosition.y() = value; });
    hear([value](ContactState& state) { state.bodyVelocity.y() = value; });
  }
  hear([](ContactState& state) { state.body = 77; });
  hear([](ContactState& state) { state.other = state.body; });
  return {exactly("not_finite", odd, 0.0)};
}

}  // namespace

void addContactCases(std::vector<StabilityCase>& cases) {
  const std::vector<StabilityCase> all = {
      {"contact.sample_rate", "sample rate", "a ball slides over waves, at 8 to 192 kHz",
       "a tone of speed over wave length, as loud as a ball that follows them: "
       "w rho a^3 / (2 c r) times its acceleration",
       rates},
      {"contact.speed", "speed", "slides at 0 to 0.4 mm/s, and at 2 km/s and more",
       "at rest, and a jump: silent", speeds},
      {"contact.after_a_day", "24 hours", "the same slide 24 h after the start", "as loud",
       afterADay},
      {"contact.everything", "nonsense",
       "all extremes of stiffness, size, speed, load, distance and rate with each other",
       "every sample is finite", everything},
      {"contact.nonsense", "nonsense", "contacts with values that are no numbers, or out of range",
       "every sample is finite", nonsense},
  };
  cases.insert(cases.end(), all.begin(), all.end());
}

}  // namespace carom::lab
