// Stiff and extreme cases of the sound of collisions:
// durations of contacts, and the sound at a listener.

#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <limits>
#include <numbers>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "lab/stability/stability_cases.h"
#include "lab/stability/stability_sources.h"

#include "audio/model/hertz.h"
#include "carom/audio/synth.h"

namespace carom::lab {

using namespace audio;

namespace {

using Measurements = std::vector<Measurement>;

constexpr double kAir = 1.20;     // kg/m^3
constexpr double kSound = 343.0;  // m/s

// ---- Durations of contacts

/// Returns the duration (s) of m d'' = -K d^(3/2) from d = 0 at `speed` until d = 0 again, by many
/// small Runge-Kutta steps, in units in which m, K and the speed are 1.
double integratedDuration(const Impact& impact) {
  constexpr double kStep = 1e-4;
  const auto pull = [](double d) { return d > 0.0 ? -d * std::sqrt(d) : 0.0; };
  double d = 0.0;
  double v = 1.0;
  double t = 0.0;
  while (d >= 0.0) {
    const double a1 = pull(d);
    const double a2 = pull(d + 0.5 * kStep * v);
    const double a3 = pull(d + 0.5 * kStep * (v + 0.5 * kStep * a1));
    const double a4 = pull(d + kStep * (v + 0.5 * kStep * a2));
    d += kStep * v + kStep * kStep / 6.0 * (a1 + a2 + a3);
    v += kStep / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
    t += kStep;
  }
  t -= d / v;
  // The unit of time is the length (m v^2 / K)^(2/5) over the speed.
  const double contact = impact.modulus / (2.0 * (1.0 - 0.3 * 0.3));
  const double stiffness = 4.0 / 3.0 * std::sqrt(impact.radius) * contact;
  const double length =
      std::pow(impact.effectiveMass() * impact.speed * impact.speed / stiffness, 0.4);
  return t * length / impact.speed;
}

double durationOf(const Impact& impact) {
  return hertzDuration(impact.event(), impact.material(), impact.material());
}

/// Relative error of the law's coefficient, which is given as 2.87 and is 2.8683.
constexpr double kRounding = 7e-4;

Measurements durationByStiffness(StabilityForm /*form*/) {
  Worst error;
  Worst power;
  const double first = durationOf({.modulus = 1e5});
  for (const double modulus : {1e5, 1e7, 1e9, 1e11, 1.2e12}) {
    const Impact impact{.modulus = modulus};
    error.addShare(durationOf(impact), integratedDuration(impact));
    power.addShare(durationOf(impact), first * std::pow(modulus / 1e5, -0.4));
  }
  return {atMost("beside_the_integrated_equation", error.value(), kRounding),
          atMost("beside_the_power_-2/5", power.value(), 1e-12)};
}

Measurements durationBySpeed(StabilityForm /*form*/) {
  Worst error;
  Worst power;
  const double first = durationOf({});
  for (const double speed : {1e-9, 1e-6, 1e-3, 1.0, 1e2, 1e4}) {
    const Impact impact{.speed = speed};
    error.addShare(durationOf(impact), integratedDuration(impact));
    power.addShare(durationOf(impact), first * std::pow(speed, -0.2));
  }
  return {atMost("beside_the_integrated_equation", error.value(), kRounding),
          atMost("beside_the_power_-1/5", power.value(), 1e-12)};
}

Measurements durationByRadius(StabilityForm /*form*/) {
  Worst error;
  Worst power;
  const double first = durationOf({.radius = 1.0});
  for (const double radius : {1e-5, 1e-4, 1e-2, 1.0, 10.0}) {
    const Impact impact{.radius = radius};
    error.addShare(durationOf(impact), integratedDuration(impact));
    power.addShare(durationOf(impact), first * radius);
  }
  return {atMost("beside_the_integrated_equation", error.value(), kRounding),
          atMost("beside_proportional", power.value(), 1e-12)};
}

// ---- Sound at the listener

struct Seat {
  double sampleRate = 48000.0;  // Hz
  double distance = 1.0;        // m, from the ball's centre, in the direction of its impulse
  bool doppler = false;         // the laws below hold for a body that does not move
  bool dissipative = false;
};

struct Heard {
  double begin = 0.0;       // s, time of the first sample
  double sampleRate = 0.0;  // Hz
  std::vector<double> samples;

  double timeOf(std::size_t sample) const {
    return begin + static_cast<double>(sample) / sampleRate;
  }
  /// Returns the integral of the pressure, Pa s.
  double integral() const {
    double sum = 0.0;
    for (const double sample : samples)
      sum += sample;
    return sum / sampleRate;
  }
  /// Returns the first moment of the pressure about an instant (s), Pa s^2.
  double moment(double about) const {
    double sum = 0.0;
    for (std::size_t sample = 0; sample < samples.size(); ++sample)
      sum += (timeOf(sample) - about) * samples[sample];
    return sum / sampleRate;
  }
  double peak() const {
    Worst largest;
    for (const double sample : samples)
      largest.add(std::abs(sample));
    return largest.value();
  }
  /// Returns the magnitude of the spectrum at a frequency (Hz), Pa s.
  double spectrum(double frequency) const {
    std::complex<double> sum = 0.0;
    for (std::size_t sample = 0; sample < samples.size(); ++sample)
      sum += samples[sample] * std::polar(1.0, -2.0 * std::numbers::pi * frequency *
                                                   static_cast<double>(sample) / sampleRate);
    return std::abs(sum) / sampleRate;
  }
  /// Returns the time (s) of the first sample above a share of the peak.
  double onset(double share) const {
    const double level = share * peak();
    for (std::size_t sample = 0; sample < samples.size(); ++sample)
      if (std::abs(samples[sample]) > level) return timeOf(sample);
    return timeOf(samples.size());
  }
};

Synth synthOf(const Impact& impact, const Seat& seat) {
  SynthSettings settings;
  settings.sampleRate = seat.sampleRate;
  settings.audibleThreshold = 0.0;
  settings.doppler = seat.doppler;
  settings.dissipative = seat.dissipative;
  settings.airAbsorption = false;  // the references have none
  Synth synth =
      orThrow(Synth::create(settings, {{.name = "seat", .position = {0.0, 0.0, seat.distance}}}));
  setBodies(synth, impact);
  return synth;
}

/// Renders the whole sound of the impact, from well before its arrival to well after.
Heard hear(const Impact& impact, const Seat& seat) {
  Synth synth = synthOf(impact, seat);
  const double contact = synth.contactDuration(impact.event());
  // The radiation filter rings for a few times radius / c.
  const double margin = 64.0 / seat.sampleRate + 0.5 * contact + 2.0 * impact.radius / kSound;
  orThrow(synth.seek(impact.time + seat.distance / kSound - margin));
  synth.schedule(impact.event());
  if (impact.otherRadius > 0.0) synth.schedule(impact.otherEvent());
  Heard heard;
  heard.begin = synth.time();
  heard.sampleRate = seat.sampleRate;
  const double length = 2.0 * margin + 2.0 * contact + 40.0 * impact.radius / kSound +
                        40.0 * impact.otherRadius / kSound;
  heard.samples = rendered(synth, static_cast<std::size_t>(length * seat.sampleRate) + 256);
  if (synth.counters().rejected + synth.counters().late > 0)
    throw std::runtime_error("the synth rejected an event, or was late");
  return heard;
}

/// Returns the integral of the pressure, Pa s. A sphere whose speed changes by dv changes the
/// potential of the flow about it by a^3 dv cos / (2 r^2), and pressure is -rho times its rate
/// (Landau, Lifshitz, Fluid Mechanics, section 10): the integral holds at any distance and for any
/// course of the force.
double potentialLaw(double radius, double speedChange, double distance) {
  return kAir * radius * radius * radius * speedChange / (2.0 * distance * distance);
}

double speedChange(const Impact& impact) {
  return impact.impulse() / impact.massOf(impact.radius);
}

/// Returns the relative error of the integral of the pressure.
double potentialError(const Impact& impact, const Seat& seat) {
  return hear(impact, seat).integral() /
             potentialLaw(impact.radius, speedChange(impact), seat.distance) -
         1.0;
}

/// Returns the relative error of the first moment of the pressure. The far field is rho a^3 / (2 c
/// r) times the second derivative of the speed. So its first moment about its arrival is -rho a^3
/// dv / (2 c r), however long the contact; that of the near field about the middle of the contact
/// is 0.
double momentError(const Impact& impact, const Seat& seat) {
  const Heard heard = hear(impact, seat);
  Synth synth = synthOf(impact, seat);
  const double arrival =
      impact.time + 0.5 * synth.contactDuration(impact.event()) + seat.distance / kSound;
  const double wanted =
      -kAir * std::pow(impact.radius, 3.0) * speedChange(impact) / (2.0 * kSound * seat.distance);
  return heard.moment(arrival) / wanted - 1.0;
}

constexpr double kAudibleError = 1e-4;  // relative: -80 dB, as docs/acceleration_noise.md promises

Measurements clickStiffness(StabilityForm /*form*/) {
  Worst potential;
  Worst moment;
  for (const double modulus : {1e5, 1e7, 1e9, 1e11, 1.2e12}) {
    potential.add(std::abs(potentialError({.modulus = modulus}, {.distance = 0.05})));
    moment.add(std::abs(momentError({.modulus = modulus}, {})));
  }
  return {atMost("integral_beside_potential_flow", potential.value(), kAudibleError),
          atMost("moment_beside_the_far_field", moment.value(), kAudibleError)};
}

Measurements clickSpeed(StabilityForm /*form*/) {
  Worst potential;
  Worst moment;
  Worst finite;
  for (const double speed : {1e-9, 1e-6, 1e-3, 1.0, 1e2, 1e4}) {
    potential.add(std::abs(potentialError({.speed = speed}, {.distance = 0.05})));
    moment.add(std::abs(momentError({.speed = speed}, {})));
    // The ball moves at up to 29 times the speed of sound along the line to the listener.
    Impact towards{.speed = speed};
    finite.add(hear(towards, {.doppler = true}).peak() / speed);
  }
  return {atMost("integral_beside_potential_flow", potential.value(), kAudibleError),
          atMost("moment_beside_the_far_field", moment.value(), kAudibleError),
          atMost("loudest_with_doppler_per_speed", finite.value(), 1e3, "Pa s/m")};
}

Measurements clickRadius(StabilityForm form) {
  Worst potential;
  Worst moment;
  std::vector<double> radii = {1e-5, 1e-4, 1e-2, 1.0, 10.0};
  if (form == StabilityForm::full) radii.insert(radii.end(), {1e-3, 1e-1, 3.0, 30.0});
  for (const double radius : radii) {
    potential.add(std::abs(potentialError({.radius = radius}, {.distance = 4.0 * radius})));
    // The far field begins at distances that are long beside the wavelengths, too.
    const double far = std::max(1.0, 100.0 * radius);
    moment.add(std::abs(momentError({.radius = radius}, {.distance = far})));
  }
  return {atMost("integral_beside_potential_flow", potential.value(), kAudibleError),
          atMost("moment_beside_the_far_field", moment.value(), kAudibleError)};
}

// Spheres of one density: the heavy one's dipole is as
// strong as the light one's, with the opposite sign.
Measurements clickMassRatio(StabilityForm /*form*/) {
  Worst error;
  for (const double ratio : {1.0, 1e3, 1e6, 1e9}) {
    Impact impact{.radius = 0.01};
    impact.otherRadius = impact.radius * std::cbrt(ratio);
    const Seat seat{.distance = 3.0 * impact.otherRadius};
    const double otherDistance = seat.distance + impact.radius + impact.otherRadius;
    const double otherChange = impact.impulse() / impact.massOf(impact.otherRadius);
    const double mine = potentialLaw(impact.radius, speedChange(impact), seat.distance);
    const double others = potentialLaw(impact.otherRadius, -otherChange, otherDistance);
    error.add(std::abs(hear(impact, seat).integral() - mine - others) / std::abs(mine));
  }
  return {atMost("integral_beside_potential_flow", error.value(), kAudibleError)};
}

Measurements clickRestitution(StabilityForm /*form*/) {
  Worst error;
  for (const double e : {0.0, 1e-9, 0.05, 0.5, 1.0})
    for (const bool dissipative : {false, true})
      error.add(std::abs(
          potentialError({.restitution = e}, {.distance = 0.05, .dissipative = dissipative})));
  return {atMost("integral_beside_potential_flow", error.value(), kAudibleError)};
}

constexpr std::array<double, 6> kRates = {8000.0, 16000.0, 44100.0, 48000.0, 96000.0, 192000.0};

// A marble of steel and a grain whose contact lasts 0.08 us, a thousandth of a sample and less.
Measurements clickRate(StabilityForm /*form*/) {
  Worst potential;
  Worst moment;
  Worst bands;
  for (const double radius : {1e-5, 0.005}) {
    const Heard finest = hear({.radius = radius}, {.sampleRate = 192000.0});
    for (const double rate : kRates) {
      potential.add(std::abs(
          potentialError({.radius = radius}, {.sampleRate = rate, .distance = 5.0 * radius})));
      moment.add(std::abs(momentError({.radius = radius}, {.sampleRate = rate})));
      const Heard heard = hear({.radius = radius}, {.sampleRate = rate});
      for (const double frequency : {125.0, 500.0, 1000.0, 2000.0, 3000.0})
        bands.add(
            std::abs(20.0 * std::log10(heard.spectrum(frequency) / finest.spectrum(frequency))));
    }
  }
  return {atMost("integral_beside_potential_flow", potential.value(), kAudibleError),
          atMost("moment_beside_the_far_field", moment.value(), kAudibleError),
          atMost("level_below_3_kHz_beside_192_kHz", bands.value(), 0.01, "dB")};
}

Measurements clickDistance(StabilityForm /*form*/) {
  Worst near;
  Worst far;
  Worst onsets;
  // 1 mm from a grain of 10 um, and from the surface of a marble.
  near.add(std::abs(potentialError({.radius = 1e-5}, {.distance = 1e-3})));
  near.add(std::abs(potentialError({}, {.distance = 0.011})));
  // Inside the marble the sound is that at its surface.
  const double inside = hear({}, {.distance = 1e-3}).integral() / potentialLaw(0.01, 2.0, 0.01);
  for (const double distance : {1.0, 100.0, 1000.0, 10000.0}) {
    far.add(std::abs(momentError({}, {.distance = distance})));
    const double onset = hear({}, {.distance = distance}).onset(1e-3);
    onsets.add(std::abs(onset - (distance - 0.01) / kSound));
  }
  return {atMost("near_integral_beside_potential_flow", near.value(), kAudibleError),
          nearly("inside_beside_the_surface", inside, 1.0, kAudibleError),
          atMost("far_moment_beside_the_far_field", far.value(), kAudibleError),
          atMost("onset_beside_distance_over_c", onsets.value(), 16.0 / 48000.0, "s")};
}

// Sound is linear: many clicks at one instant are one click, so many times as loud.
Measurements clickSimultaneous(StabilityForm /*form*/) {
  constexpr int kCount = 1000;
  Synth one = synthOf({.time = 0.01}, {});
  Synth many = synthOf({.time = 0.01}, {});
  one.schedule(Impact{.time = 0.01}.event());
  for (int click = 0; click < kCount; ++click)
    many.schedule(Impact{.time = 0.01}.event());
  const std::vector<double> single = rendered(one, 2400);
  const std::vector<double> all = rendered(many, 2400);
  Worst error;
  Worst peak;
  for (std::size_t sample = 0; sample < all.size(); ++sample) {
    peak.add(std::abs(kCount * single[sample]));
    error.add(std::abs(all[sample] - kCount * single[sample]));
  }
  return {atMost("beside_1000_times_one", error.value() / peak.value(), 1e-12),
          atLeast("peak", peak.value(), 1e-3, "Pa")};
}

// The time of an event is a double: a day after the start it is within 7.3 ps, which at the end of
// the band changes a sample by 2 pi 20 kHz 7.3 ps of the peak at most.
Measurements clickAfterADay(StabilityForm /*form*/) {
  constexpr double kDay = 86400.0;
  Worst error;
  for (const double radius : {1e-4, 0.01, 0.1}) {
    for (const double phase : {0.0, 0.3, 0.77}) {
      const double time = 0.01 + phase / 48000.0;
      const Heard first = hear({.radius = radius, .time = time}, {});
      const Heard later = hear({.radius = radius, .time = kDay + time}, {});
      for (std::size_t sample = 0; sample < first.samples.size(); ++sample)
        error.add(std::abs(first.samples[sample] - later.samples[sample]) / first.peak());
    }
  }
  return {atMost("beside_the_first_day", error.value(),
                 2.0 * std::numbers::pi * 20e3 * (0x1p-37 + 0x1p-39))};
}

// A click every minute, without a break, at a sample rate at
// which a minute is a whole number of samples.
Measurements clickLongRun(StabilityForm form) {
  constexpr double kRate = 8000.0;
  constexpr double kMinute = 60.0;
  const int minutes = form == StabilityForm::brief ? 10 : 1440;
  Synth synth = synthOf({}, {.sampleRate = kRate});
  std::vector<double> first;
  Worst error;
  double odd = 0.0;
  for (int minute = 0; minute < minutes; ++minute) {
    synth.schedule(Impact{.time = minute * kMinute + 0.0123}.event());
    const std::vector<double> sound = rendered(synth, static_cast<std::size_t>(kMinute * kRate));
    if (first.empty()) first = sound;
    for (std::size_t sample = 0; sample < sound.size(); ++sample) {
      error.add(std::abs(sound[sample] - first[sample]));
      if (sound[sample] != 0.0 && std::fpclassify(sound[sample]) == FP_SUBNORMAL) odd += 1.0;
    }
  }
  Worst peak;
  for (const double sample : first)
    peak.add(std::abs(sample));
  return {atMost("beside_the_first_click", error.value() / peak.value(), 1e-7),
          exactly("denormal_samples", odd, 0.0)};
}

/// Returns the loudest sample (Pa) of all channels of a
/// microphone and two pairs, one of them with cardioids.
double loudestOf(const Impact& impact, const Seat& seat) {
  SynthSettings settings;
  settings.sampleRate = seat.sampleRate;
  settings.audibleThreshold = 0.0;
  settings.dissipative = true;
  const Vec3 place(0.0, 0.0, seat.distance);
  Listener spaced{.name = "spaced", .position = place};
  spaced.format = ListenerFormat::spacedPair;
  Listener coincident{.name = "coincident", .position = place};
  coincident.format = ListenerFormat::coincidentPair;
  Synth synth =
      orThrow(Synth::create(settings, {{.name = "mono", .position = place}, spaced, coincident}));
  setBodies(synth, impact);
  orThrow(synth.seek(seat.distance / kSound));
  synth.schedule(impact.event());
  synth.schedule(impact.otherEvent());
  std::vector<std::vector<double>> planes(synth.channelCount(), std::vector<double>(256));
  std::vector<double*> channels;
  channels.reserve(planes.size());
  for (std::vector<double>& plane : planes)
    channels.push_back(plane.data());
  synth.render<double>(channels, planes.front().size());
  Worst loudest;
  for (const std::vector<double>& plane : planes)
    for (const double sample : plane)
      loudest.add(std::abs(sample));
  return loudest.value();
}

// All extremes at once: only some have a law, but all must be finite.
Measurements clickEverything(StabilityForm form) {
  double odd = 0.0;
  double impacts = 0.0;
  const std::vector<double> rates = form == StabilityForm::full
                                        ? std::vector<double>(kRates.begin(), kRates.end())
                                        : std::vector<double>{8000.0, 192000.0};
  for (const double rate : rates)
    for (const double modulus : {1e5, 1.2e12})
      for (const double radius : {1e-5, 1e-2, 10.0})
        for (const double speed : {1e-9, 1.0, 1e4})
          for (const double distance : {1e-3, 1.0, 1e4})
            for (const double otherRadius : {0.0, 10.0}) {
              const double loudest = loudestOf({.radius = radius,
                                                .modulus = modulus,
                                                .speed = speed,
                                                .otherRadius = otherRadius},
                                               {.sampleRate = rate, .distance = distance});
              impacts += 1.0;
              if (!std::isfinite(loudest)) odd += 1.0;
            }
  return {atLeast("impacts", impacts, 200.0), exactly("not_finite", odd, 0.0)};
}

Measurements clickNonsense(StabilityForm /*form*/) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinite = std::numeric_limits<double>::infinity();
  Synth synth = synthOf({}, {});
  double scheduled = 0.0;
  const auto add = [&](auto change) {
    ImpulseEvent event = Impact{}.event();
    change(event);
    synth.schedule(event);
    scheduled += 1.0;
  };
  for (const double odd : {nan, infinite, -infinite}) {
    add([odd](ImpulseEvent& event) { event.time = odd; });
    add([odd](ImpulseEvent& event) { event.impulse.z() = odd; });
    add([odd](ImpulseEvent& event) { event.position.x() = odd; });
    add([odd](ImpulseEvent& event) { event.bodyPosition.x() = odd; });
    add([odd](ImpulseEvent& event) { event.bodyVelocity.y() = odd; });
    add([odd](ImpulseEvent& event) { event.effectiveMass = odd; });
    add([odd](ImpulseEvent& event) { event.approachSpeed = odd; });
  }
  add([nan](ImpulseEvent& event) { event.radius = nan; });
  add([](ImpulseEvent& event) { event.effectiveMass = 0.0; });
  add([](ImpulseEvent& event) { event.approachSpeed = 0.0; });
  add([](ImpulseEvent& event) { event.approachSpeed = -1.0; });
  add([](ImpulseEvent& event) { event.body = 77; });
  Worst heard;
  for (const double sample : rendered(synth, 4800))
    heard.add(std::abs(sample));
  double taken = 0.0;
  for (const double rate : {nan, infinite, -48000.0, 0.0, 7999.0, 192001.0}) {
    SynthSettings settings;
    settings.sampleRate = rate;
    if (Synth::create(settings, {{.name = "seat", .position = Vec3::UnitZ()}})) taken += 1.0;
  }
  for (const double place : {nan, infinite})
    if (Synth::create({}, {{.name = "seat", .position = {place, 0.0, 0.0}}})) taken += 1.0;
  for (const double odd : {nan, infinite, -1.0, 0.0}) {
    SoundBody body = Impact{}.ball();
    body.radius = odd;
    if (synth.setBody(3, body)) taken += 1.0;
  }
  return {exactly("settings_taken", taken, 0.0),
          exactly("rejected", static_cast<double>(synth.counters().rejected), scheduled),
          exactly("loudest_sample", heard.value(), 0.0, "Pa")};
}

}  // namespace

void addSoundCases(std::vector<StabilityCase>& cases) {
  const char* const kPotential =
      "the integral of pressure is rho a^3 dv / (2 r^2), the flow's change of potential; its first "
      "moment -rho a^3 dv / (2 c r), whatever the contact's course";
  const std::vector<StabilityCase> all = {
      {"hertz.stiffness", "stiffness", "how long contacts of 1e5 to 1.2e12 Pa last",
       "m d'' = -K d^(3/2), integrated; E to the power -2/5", durationByStiffness},
      {"hertz.speed", "speed", "how long contacts at 1e-9 to 1e4 m/s last",
       "m d'' = -K d^(3/2), integrated; v to the power -1/5", durationBySpeed},
      {"hertz.radius", "radius", "how long contacts of spheres of 10 um to 10 m last",
       "m d'' = -K d^(3/2), integrated; in proportion to R", durationByRadius},
      {"click.stiffness", "stiffness", "clicks of balls of 1e5 to 1.2e12 Pa", kPotential,
       clickStiffness},
      {"click.speed", "speed", "clicks at 1e-9 to 1e4 m/s, 29 times the speed of sound", kPotential,
       clickSpeed},
      {"click.radius", "radius", "clicks of balls of 10 um to 10 m (full: 30 m)", kPotential,
       clickRadius},
      {"click.mass_ratio", "mass ratio",
       "both clicks of balls of one density, of mass ratios 1 to 1e9",
       "potential flow of both: their dipoles are equal and opposite", clickMassRatio},
      {"click.restitution", "restitution",
       "clicks of restitution 0 to 1, of elastic and of dissipative pulses",
       "potential flow, of an impulse of (1 + e) m v", clickRestitution},
      {"click.sample_rate", "sample rate", "clicks of 0.08 us and 39 us at 8 to 192 kHz",
       "the same laws, and the same spectrum below "
       "3 kHz, at each rate",
       clickRate},
      {"click.distance", "distance", "listeners 1 mm from, and in, what clicks, and 10 km away",
       "potential flow close by; 1 / r far away, after r / c", clickDistance},
      {"click.simultaneous", "simultaneous contacts", "1000 clicks at one instant",
       "sound is linear: 1000 times one", clickSimultaneous},
      {"click.after_a_day", "24 hours", "clicks 24 h after the start",
       "those of the first second, but for 7.3 ps, the rounding of their time", clickAfterADay},
      {"click.long_run", "24 hours",
       "a click a minute for 10 minutes (full: 24 hours), without a break",
       "each as the first, but for the rounding of its time; no denormal numbers", clickLongRun},
      {"click.everything", "nonsense",
       "all extremes of stiffness, size, speed, distance and rate with each other, at a microphone "
       "and two pairs",
       "every sample is finite", clickEverything},
      {"click.nonsense", "nonsense", "events with values that are no numbers, infinite, or 0",
       "each is rejected and counted; silence", clickNonsense},
  };
  cases.insert(cases.end(), all.begin(), all.end());
}

}  // namespace carom::lab
