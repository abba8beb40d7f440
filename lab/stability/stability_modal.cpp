// Stiff and extreme cases of bodies that ring.

#include <cmath>
#include <complex>
#include <limits>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "lab/stability/stability_cases.h"
#include "lab/stability/stability_sources.h"

#include "audio/dsp/resonator_kernels.h"
#include "audio/dsp/spread_kernel.h"
#include "carom/audio/modal_model.h"
#include "carom/audio/synth.h"

namespace carom::lab {

using namespace audio;

namespace {

using Measurements = std::vector<Measurement>;
using Complex = std::complex<double>;

constexpr double kPi = std::numbers::pi;
constexpr double kAudibleError = 1e-4;  // relative: -80 dB
constexpr double kDistance = 2.0;       // m

Synth synthOf(const Tone& tone, double sampleRate) {
  SynthSettings settings;
  settings.sampleRate = sampleRate;
  settings.audibleThreshold = 0.0;
  settings.airAbsorption = false;  // the references have none
  Synth synth =
      orThrow(Synth::create(settings, {{.name = "seat", .position = {0.0, 0.0, kDistance}}}));
  setBodies(synth, Blow{.tone = tone});
  return synth;
}

/// Renders and drops the sound until the clock has reached `time` (s).
void renderUntil(Synth& synth, double time) {
  constexpr double kBlock = 65536.0;
  while (synth.time() < time - 0.5 / synth.sampleRate()) {
    const double left = std::round((time - synth.time()) * synth.sampleRate());
    rendered(synth, static_cast<std::size_t>(std::min(left, kBlock)));
  }
}

/// Returns the complex amplitude, at the present time of the synth, of a decaying tone that began
/// at `begin` (s), divided by exp((-decay + i w) (t - begin)): for a tone that keeps its decay and
/// its frequency this is the same at all times. Averages over at least a hundred periods and a
/// tenth of a second.
Complex amplitudeAt(Synth& synth, const Tone& tone, double begin) {
  const double first = synth.time();
  const double rate = synth.sampleRate();
  const double length = std::max(0.1, 100.0 / tone.frequency);
  const auto frames = static_cast<std::size_t>(std::round(length * rate));
  const std::vector<double> samples = rendered(synth, frames);
  const Complex pole(-tone.decayRate, tone.damped());
  Complex sum = 0.0;
  double weight = 0.0;
  for (std::size_t sample = 0; sample < frames; ++sample) {
    const double place = static_cast<double>(sample) / static_cast<double>(frames);
    const double window = 1.0 - std::cos(2.0 * kPi * place);  // suppresses the mirrored frequency
    const double time = first + static_cast<double>(sample) / rate - begin;
    sum += window * samples[sample] * std::exp(-pole * time);
    weight += window;
  }
  return 2.0 / weight * sum;
}

/// Returns the expected amplitude in Pa: rho V / (4 pi r) times the acceleration of a mode that an
/// impulse sets off, q'' = shape j (...) exp(-decay t), at its begin.
double loudness(const Tone& tone) {
  const double w = 2.0 * kPi * tone.frequency;
  return 1.20 * kBellVolume / (4.0 * kPi * kDistance) * kBellShape * kBlowImpulse * w * w /
         tone.damped();
}

struct Ringing {
  double drift = 0.0;     // relative, of amplitude and phase, from begin to `seconds`
  double loudness = 0.0;  // over that of theory
};

Ringing ringing(const Tone& tone, double sampleRate, double seconds, double begin = 0.0) {
  Synth synth = synthOf(tone, sampleRate);
  orThrow(synth.seek(begin));
  const double blowTime = begin + 0.01;
  synth.schedule(Blow{.time = blowTime}.event());
  renderUntil(synth, begin + 0.1);
  const double arrival = blowTime + kDistance / 343.0;
  const Complex early = amplitudeAt(synth, tone, arrival);
  renderUntil(synth, begin + seconds);
  const Complex late = amplitudeAt(synth, tone, arrival);
  return {std::abs(late / early - 1.0), std::abs(early) / loudness(tone)};
}

/// Returns the decay rate (1/s) of a sound that is 60 dB lower after `seconds`.
double decayOf60dB(double seconds) {
  return std::log(1000.0) / seconds;
}

// Bound of the drift: a rounding of the coefficients turns the pole by 2^-53 / sin(w / rate) in
// each sample.
double recursionBound(const Tone& tone, double rate, double seconds) {
  return 4.0 * seconds * rate * 0x1p-53 / std::sin(2.0 * kPi * tone.frequency / rate);
}

Measurements lowAndLong(StabilityForm form) {
  Worst drift;
  Worst loud;
  std::vector<double> rates = {8000.0, 48000.0};
  if (form == StabilityForm::full) rates.push_back(192000.0);
  for (const double rate : rates) {
    for (const double decay : {1.0 / 60.0, decayOf60dB(60.0)}) {
      const Ringing ring = ringing({20.0, decay}, rate, 60.0);
      drift.add(ring.drift);
      loud.add(std::abs(ring.loudness - 1.0));
    }
  }
  // The bound is that of a resonator with coefficients in double precision.
  const double bound = recursionBound({20.0, 0.0}, rates.back(), 60.0);
  return {atMost("drift_of_amplitude_and_phase_in_60_s", drift.value(), bound),
          atMost("loudness_share", loud.value(), kAudibleError)};
}

// The rendered band ends at 0.4167 of the sample rate; a mode beyond it is not rendered.
Measurements nyquist(StabilityForm /*form*/) {
  Worst drift;
  Worst loud;
  Worst beyond;
  for (const double rate : {8000.0, 16000.0, 32000.0, 40000.0, 47000.0}) {
    const Tone edge{std::min(0.999 * kBand * rate, 0.999 * kHighestMode), decayOf60dB(60.0)};
    const Ringing ring = ringing(edge, rate, 10.0);
    drift.add(ring.drift);
    loud.add(std::abs(ring.loudness - 1.0));
    if (0.999 * rate / 2.0 > kHighestMode) continue;
    Synth synth = synthOf({0.999 * rate / 2.0, decayOf60dB(60.0)}, rate);
    synth.schedule(Blow{.time = 0.01}.event());
    for (const double sample : rendered(synth, 8000))
      beyond.add(std::abs(sample));
  }
  return {atMost("drift_at_0.999_of_the_band_in_10_s", drift.value(), 1e-6),
          atMost("loudness_share_at_0.999_of_the_band", loud.value(), kAudibleError),
          exactly("peak_at_0.999_of_nyquist", beyond.value(), 0.0, "Pa")};
}

/// Returns the largest deviation of a free resonator from exp(-decay t) cos(w t), as a share of its
/// amplitude at the time.
double recursionError(const Tone& tone, double rate, double seconds) {
  const double w = tone.damped();
  const TwoPole pole = TwoPole::of(w, tone.decayRate, rate);
  std::vector<double> a1(ResonatorKernels::kWidth, 0.0);
  std::vector<double> a2 = a1;
  std::vector<double> y1 = a1;
  std::vector<double> y2 = a1;
  a1[0] = pole.a1;
  a2[0] = pole.a2;
  const auto at = [&](double sample) {
    const double time = sample / rate;
    return std::exp(-tone.decayRate * time) * std::cos(w * time);
  };
  y1[0] = at(-1.0);
  y2[0] = at(-2.0);
  const Resonators resonators{a1.data(), a2.data(), y1.data(), y2.data(), a1.size()};
  constexpr std::size_t kBlock = 4096;
  std::vector<double> out(kBlock);
  const auto blocks = static_cast<std::size_t>(seconds * rate / kBlock);
  Worst error;
  for (std::size_t block = 0; block < blocks; ++block) {
    std::ranges::fill(out, 0.0);
    fastestResonators().ring(resonators, out);
    if (block % 16 != 0 && block + 1 != blocks) continue;
    for (std::size_t sample = 0; sample < kBlock; ++sample) {
      const auto index = static_cast<double>(block * kBlock + sample);
      error.add(std::abs(out[sample] - at(index)) / std::exp(-tone.decayRate * index / rate));
    }
  }
  return error.value();
}

Measurements recursion(StabilityForm form) {
  Worst error;
  for (const double decay : {0.0, decayOf60dB(60.0)}) {
    for (const double rate : {8000.0, 48000.0, 192000.0}) {
      if (form == StabilityForm::brief && rate > 48000.0) continue;
      for (const double frequency : {20.0, 0.25 * rate, 0.999 * 0.5 * rate}) {
        const Tone tone{frequency, decay};
        error.add(recursionError(tone, rate, 60.0) / recursionBound(tone, rate, 60.0));
      }
    }
  }
  return {atMost("error_after_60_s_over_that_of_the_coefficients", error.value(), 1.0)};
}

Measurements sampleRates(StabilityForm /*form*/) {
  Worst loud;
  Worst drift;
  for (const double rate : {8000.0, 16000.0, 44100.0, 48000.0, 96000.0, 192000.0}) {
    for (const double frequency : {20.0, 300.0, 2900.0}) {
      const Ringing ring = ringing({frequency, 0.5}, rate, 2.0);
      loud.add(std::abs(ring.loudness - 1.0));
      drift.add(ring.drift);
    }
  }
  return {atMost("loudness_share", loud.value(), kAudibleError),
          atMost("drift_in_2_s", drift.value(), 1e-6)};
}

Measurements afterADay(StabilityForm /*form*/) {
  Worst loud;
  Worst drift;
  for (const double frequency : {20.0, 1000.0, 15000.0}) {
    const Ringing ring = ringing({frequency, 0.5}, 48000.0, 3.0, 86400.0);
    loud.add(std::abs(ring.loudness - 1.0));
    drift.add(ring.drift);
  }
  return {atMost("loudness_share", loud.value(), kAudibleError),
          atMost("drift_in_3_s", drift.value(), 1e-5)};
}

/// Returns the pressure in Pa at a time after an impulse has arrived: gain q'', where q oscillates
/// or creeps back.
double freeResponse(const Tone& tone, double time) {
  const double w = tone.damped();
  const double decay = tone.decayRate;
  const double sine = w * time > 1e-9 ? std::sin(w * time) / w : time;
  const double gain = 1.20 * kBellVolume / (4.0 * kPi * kDistance) * kBellShape * kBlowImpulse;
  return gain * std::exp(-decay * time) *
         ((decay * decay - w * w) * sine - 2.0 * decay * std::cos(w * time));
}

// Modes with a damping from none to slightly below critical, which hardly oscillate at the end.
Measurements damping(StabilityForm /*form*/) {
  Worst error;
  double silent = 0.0;
  for (const double share : {0.0, 1e-12, 0.1, 0.9, 0.999, 0.999999, 1.0 - 0x1p-53}) {
    for (const double frequency : {20.0, 200.0, 1000.0}) {
      const Tone tone{frequency, share * 2.0 * kPi * frequency};
      Synth synth = synthOf(tone, 48000.0);
      synth.schedule(Blow{.time = 0.01}.event());
      const double arrival =
          0.01 + 0.5 * synth.contactDuration(Blow{.time = 0.01}.event()) + kDistance / 343.0;
      renderUntil(synth, arrival + 50.0 / 48000.0);  // the impact itself is over
      const double begin = synth.time();
      const std::vector<double> samples = rendered(synth, 48000);
      for (std::size_t sample = 0; sample < samples.size(); ++sample) {
        const double time = begin + static_cast<double>(sample) / 48000.0 - arrival;
        error.add(std::abs(samples[sample] - freeResponse(tone, time)) /
                  loudness({frequency, 0.0}));
      }
      if (share >= 0.1 && !(std::abs(samples.back()) < 1e-3 * std::abs(samples.front())))
        silent += 1.0;
    }
  }
  return {atMost("beside_the_oscillator", error.value(), kAudibleError),
          exactly("that_still_ring_after_1_s", silent, 0.0)};
}

Measurements nonsense(StabilityForm /*form*/) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinite = std::numeric_limits<double>::infinity();
  std::vector<ModalModel> models;
  const auto add = [&models](auto change) {
    ModalModel model = *bellOf({440.0, 1.0});
    change(model);
    models.push_back(std::move(model));
  };
  for (const double odd : {nan, infinite, -1.0}) {
    add([odd](ModalModel& model) { model.modes[0].frequency = odd; });
    add([odd](ModalModel& model) { model.modes[0].decayRate = odd; });
    add([odd](ModalModel& model) { model.mass = odd; });
    add([odd](ModalModel& model) { model.medium.speedOfSound = odd; });
  }
  for (const double odd : {nan, infinite}) {
    add([odd](ModalModel& model) { model.modes[0].radiation.volume = odd; });
    add([odd](ModalModel& model) { model.shapes[1] = static_cast<float>(odd); });
    add([odd](ModalModel& model) { model.surface.vertices[0].x() = odd; });
  }
  add([](ModalModel& model) { model.modes[0].decayRate = 2.0 * kPi * 440.0; });
  add([](ModalModel& model) { model.shapes.pop_back(); });
  add([](ModalModel& model) { model.surface.triangles[0][0] = 4; });
  add([](ModalModel& model) { model.modes.resize(2); });
  double taken = 0.0;
  for (const ModalModel& model : models)
    if (validate(model)) taken += 1.0;
  return {exactly("models_taken_of_" + std::to_string(models.size()), taken, 0.0)};
}

}  // namespace

void addModalCases(std::vector<StabilityCase>& cases) {
  const char* const kOscillator =
      "a damped oscillator that an impulse sets off: exp(-decay t) cos(w t + phase), as loud as "
      "rho V q'' / (4 pi r)";
  const std::vector<StabilityCase> all = {
      {"modal.low_and_long", "modes",
       "a mode of 20 Hz that falls to 1/e, or by 60 dB, in 60 s, at 8 and 48 kHz (full: 192 kHz)",
       kOscillator, lowAndLong},
      {"modal.nyquist", "modes",
       "modes at 0.999 of the rendered band, and at 0.999 of half the sample rate",
       "the first as "
       "any other; the second, beyond the band, is silent",
       nyquist},
      {"modal.recursion", "modes",
       "the resonators themselves at 20 Hz, rate / 4 and 0.999 of half the rate, for 60 s",
       "exp(-decay t) cos(w t), but for the rounding of the coefficients over sin(w / rate)",
       recursion},
      {"modal.damping", "modes", "damping from none to a bit below critical",
       "after an impulse exp(-decay t) ((decay^2 - w^2) sin(w t) / w - 2 decay cos(w t))", damping},
      {"modal.sample_rate", "sample rate", "modes of 20, 300 and 2900 Hz at 8 to 192 kHz",
       kOscillator, sampleRates},
      {"modal.after_a_day", "24 hours", "a bell that is hit 24 h after the start", kOscillator,
       afterADay},
      {"modal.nonsense", "nonsense", "models with values that are no numbers, or out of range",
       "each is refused", nonsense},
  };
  cases.insert(cases.end(), all.begin(), all.end());
}

}  // namespace carom::lab
