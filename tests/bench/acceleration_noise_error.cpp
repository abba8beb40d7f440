// Error of a click, for every pulse, sampling, radiation and contact duration: one table, each
// error beside the cost of the click. `--help` describes the arguments and the columns.

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <complex>
#include <cstdio>
#include <cstring>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "carom/audio/material.h"
#include "tests/bench/click_cost.h"
#include "tests/bench/oversampled_click.h"
#include "tests/bench/scale.h"
#include "tests/support/click_spectrum.h"

namespace carom::bench {

using namespace audio;

namespace {

using test::ClickCase;
using Spectrum = std::vector<std::complex<double>>;

constexpr char kHelp[] =
    R"(usage: bench_acceleration_noise_error [--csv FILE] [--short]
       ./bench acceleration_noise_error [--short] [-- --csv FILE]

One click of a rigid ball at a time, as Synth renders it, for every pulse x sampling x radiation and
contact durations from 1 us to 100 ms, at 48 kHz; band-limited Hertz at 8 and 192 kHz too. The ball
is as large as a steel ball must be for such a contact with steel at 1 m/s, but at least 1 mm and at
most 1 m; the listener is straight ahead, 1 m from its surface. All contacts of a row group last
equally long, the dissipative one (restitution 0.5) included.

  error      energy of what is wrong over energy of the click, in the band (below 0.4167 of the
             sample rate), against the closed-form spectrum of the same pulse and radiation; worst
             of 16 evenly spaced places between two samples, and where the contact is shorter than
             4 samples of 16 more that put a sample into the contact
  place      the worst one: samples from a sample to first touch, as heard
  impulse    spread over these places of the impulse that the samples carry, in % of what is due:
             from their sum (exact: the near field), or from their first moment (compact)
  energy     spread over these places of the level in the band
  level      of the exact click with this pulse against that of the Hertz pulse, of equal duration
             and, but for the hand-out's, equal impulse
  shape      energy of the difference between the two, over that of the Hertz click
  model      energy of the difference between the compact formula and the exact sphere, over that
             of the exact sphere, both with this pulse and without sampling
  cost       ns of CPU time: schedule and render, per click at 200,000 clicks a second; measured in
             the same run, the least of 5 rounds

  --csv FILE   writes the rows to FILE as well
  --short      two of the durations
)";

constexpr double kDurations[] = {1e-6, 10e-6, 30e-6, 100e-6, 300e-6, 1e-3, 10e-3, 100e-3};  // s
constexpr double kFewDurations[] = {30e-6, 300e-6};
constexpr double kOracleDurations[] = {10e-6, 30e-6, 100e-6, 1e-3};
constexpr double kBar = -80.0;         // dB
constexpr double kMostSpread = 200.0;  // dB; with a larger spread the click is silent at some place
constexpr int kPlaces = 16;
constexpr double kSilence = 1e-300;

struct NamedPulse {
  const char* name;
  PulseShape shape = PulseShape::hertz;
  double restitution = 1.0;
};
constexpr NamedPulse kPulses[] = {{"hertz"},
                                  {"half_sine", PulseShape::halfSine},
                                  {"gaussian", PulseShape::gaussian},
                                  {"mitchell_netravali", PulseShape::mitchellNetravali},
                                  {"course_gaussian", PulseShape::courseGaussian},
                                  {"dissipative_hertz", PulseShape::hertz, 0.5}};

const char* nameOf(Sampling sampling) {
  return sampling == Sampling::bandLimited ? "band_limited" : "naive";
}

const char* nameOf(Radiation radiation) {
  return radiation == Radiation::exact ? "exact" : "compact";
}

double decibels(double energyRatio) {
  return 10.0 * std::log10(energyRatio + kSilence);
}

struct ErrorRow {
  const char* pulse = "";
  ClickCase click;
  double worstError = -std::numeric_limits<double>::infinity();  // dB
  double worstPlace = 0.0;                                       // samples
  double impulseSpread = 0.0;                                    // 1
  double energySpread = 0.0;                                     // dB
  double level = 0.0;                                            // dB
  double shape = 0.0;                                            // dB
  double model = 0.0;                                            // dB
  double cost = 0.0;                                             // ns
};

ClickCase clickOf(const NamedPulse& pulse, double duration, double sampleRate) {
  ClickCase click;
  click.pulse = pulse.shape;
  click.restitution = pulse.restitution;
  click.duration = duration;
  click.sampleRate = sampleRate;
  click.radius = std::clamp(duration / 7.76e-3, 0.001, 1.0);
  click.distance = click.radius + 1.0;
  // Room ahead of the click: a Gaussian begins well before its contact, and the filters have delay.
  click.time = std::ceil(80.0 + 3.0 * duration * sampleRate) / sampleRate;
  return click;
}

double delayOf(const ClickCase& click) {
  const double ahead = click.radiation == Radiation::exact ? click.radius : 0.0;
  return (click.distance - ahead) / Medium().speedOfSound;
}

/// Times from a sample to first touch as heard, in samples.
std::vector<double> placesOf(const ClickCase& click) {
  std::vector<double> places;
  for (int i = 0; i < kPlaces; ++i)
    places.push_back(static_cast<double>(i) / kPlaces);
  const double length = click.duration * click.sampleRate;
  for (int i = 0; i < kPlaces && length < 4.0; ++i) {
    const double before = (i + 0.5) / kPlaces * length;
    places.push_back(std::ceil(before) - before);
  }
  return places;
}

ClickCase placed(ClickCase click, double place) {
  const double heard = (click.time + delayOf(click)) * click.sampleRate;
  click.time += (std::ceil(heard) - heard + place) / click.sampleRate;
  return click;
}

/// Impulse that the samples carry, relative to the due one. See kHelp.
double impulseOf(const std::vector<double>& samples, const ClickCase& click) {
  const Medium air;
  const Pulse pulse = test::pulseOf(click);
  const bool exact = click.radiation == Radiation::exact;
  const double loudness = air.density * std::pow(click.radius, 3) * test::speedChange(click) *
                          pulse.impulse() / (2.0 * air.speedOfSound * click.distance);
  const double centre = click.time + delayOf(click) + pulse.centre() * click.duration;
  double sum = 0.0;
  for (std::size_t sample = 0; sample < samples.size(); ++sample) {
    const double time = static_cast<double>(sample) / click.sampleRate;
    sum += samples[sample] * (exact ? 1.0 : centre - time) / click.sampleRate;
  }
  return sum / (loudness * (exact ? air.speedOfSound / click.distance : 1.0));
}

Spectrum heard(const ClickCase& click, Spectrum force, const std::vector<double>& frequencies) {
  for (std::size_t i = 0; i < force.size(); ++i)
    force[i] *= test::radiatedSpectrum(click, frequencies[i]);
  return force;
}

/// Energy of the difference over that of `reference`, in dB.
double differenceOf(Spectrum spectrum, const Spectrum& reference,
                    const std::vector<double>& frequencies) {
  for (std::size_t i = 0; i < spectrum.size(); ++i)
    spectrum[i] -= reference[i];
  return decibels(test::energyOf(spectrum, frequencies) / test::energyOf(reference, frequencies));
}

struct Range {
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -std::numeric_limits<double>::infinity();

  void add(double value) {
    lowest = std::min(lowest, value);
    highest = std::max(highest, value);
  }
  double spread() const { return highest - lowest; }
};

void measureSampling(ErrorRow& row, const Spectrum& force, const std::vector<double>& frequencies) {
  Range impulse;
  Range level;
  for (const double place : placesOf(row.click)) {
    const ClickCase click = placed(row.click, place);
    const std::vector<double> samples = test::renderClick(click);
    const Spectrum made = test::spectrumOf(samples, click.sampleRate, frequencies);
    const Spectrum exact = heard(click, force, frequencies);
    const double error = differenceOf(made, exact, frequencies);
    if (error > row.worstError) row.worstPlace = place;
    row.worstError = std::max(row.worstError, error);
    impulse.add(impulseOf(samples, click));
    level.add(decibels(test::energyOf(made, frequencies) / test::energyOf(exact, frequencies)));
  }
  row.impulseSpread = impulse.spread();
  row.energySpread = std::min(level.spread(), kMostSpread);
}

/// Compares the pulse with Hertz's and the compact formula with the exact sphere, without sampling.
void measureModel(ErrorRow& row, const Spectrum& force, const Spectrum& hertz,
                  const std::vector<double>& frequencies) {
  ClickCase click = row.click;
  click.restitution = 1.0;  // the same impulse for both
  const Spectrum ours = heard(click, force, frequencies);
  const Spectrum theirs = heard(click, hertz, frequencies);
  row.level = decibels(test::energyOf(ours, frequencies) / test::energyOf(theirs, frequencies));
  row.shape = differenceOf(ours, theirs, frequencies);
  click.radiation = Radiation::compact;
  const Spectrum compact = heard(click, force, frequencies);
  click.radiation = Radiation::exact;
  row.model = differenceOf(compact, heard(click, force, frequencies), frequencies);
}

struct Group {
  double sampleRate = 48000.0;
  double duration = 0.0;
  bool isReduced = false;  // only band-limited Hertz
};

std::vector<ErrorRow> measure(const Group& group) {
  std::vector<ErrorRow> rows;
  std::vector<ClickCase> clicks;
  Spectrum hertz;
  for (const NamedPulse& pulse : kPulses) {
    if (group.isReduced && &pulse != kPulses) continue;
    ErrorRow row{.pulse = pulse.name, .click = clickOf(pulse, group.duration, group.sampleRate)};
    const std::vector<double> frequencies = test::bandFrequencies(row.click);
    const Spectrum force = test::forceSpectrum(row.click, frequencies);
    if (hertz.empty()) hertz = force;
    for (const Sampling sampling : {Sampling::bandLimited, Sampling::naive}) {
      if (group.isReduced && sampling == Sampling::naive) continue;
      for (const Radiation radiation : {Radiation::exact, Radiation::compact}) {
        row.click.sampling = sampling;
        row.click.radiation = radiation;
        rows.push_back(row);
        measureSampling(rows.back(), force, frequencies);
        measureModel(rows.back(), force, hertz, frequencies);
        clicks.push_back(row.click);
      }
    }
  }
  const std::vector<double> costs = clickCosts(clicks);
  for (std::size_t i = 0; i < rows.size(); ++i)
    rows[i].cost = costs[i];
  return rows;
}

std::string formatted(const char* format, double value) {
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

// The difference of a spectrum to itself prints as `none`.
std::string differenceText(double value, const char* none = "-") {
  return value < -1000.0 ? none : formatted("%.1f", value);
}

std::string durationText(double seconds) {
  return seconds < 0.9995e-3 ? formatted("%.0f us", seconds * 1e6)
                             : formatted("%.0f ms", seconds * 1e3);
}

void printGroup(const std::vector<ErrorRow>& rows) {
  const ClickCase& click = rows.front().click;
  std::printf(
      "\ncontact of %s at %g kHz (%.3g samples), ball of %.3g mm, listener %.4g m from its "
      "centre\n",
      durationText(click.duration).c_str(), click.sampleRate / 1000.0,
      click.duration * click.sampleRate, click.radius * 1e3, click.distance);
  std::printf("%-18s %-12s %-9s %8s %6s %9s %8s %7s %8s %8s %9s\n", "pulse", "sampling",
              "radiation", "error", "place", "impulse", "energy", "level", "shape", "model",
              "cost");
  std::printf("%-18s %-12s %-9s %8s %6s %9s %8s %7s %8s %8s %9s\n", "", "", "", "dB", "", "%", "dB",
              "dB", "dB", "dB", "ns");
  for (const ErrorRow& row : rows) {
    const bool compact = row.click.radiation == Radiation::compact;
    const std::string energy =
        row.energySpread < kMostSpread ? formatted("%.2g", row.energySpread) : "silent";
    std::printf("%-18s %-12s %-9s %8.1f %6.3f %9.2g %8s %7.2f %8s %8s %9.0f\n", row.pulse,
                nameOf(row.click.sampling), nameOf(row.click.radiation), row.worstError,
                row.worstPlace, 100.0 * row.impulseSpread, energy.c_str(), row.level,
                differenceText(row.shape).c_str(),
                compact ? differenceText(row.model).c_str() : "-", row.cost);
  }
  std::fflush(stdout);
}

/// Worst error of a sampling in a group, over pulses and radiations.
std::string worstOf(const std::vector<ErrorRow>& rows, const Group& group, Sampling sampling) {
  double worst = -std::numeric_limits<double>::infinity();
  for (const ErrorRow& row : rows) {
    const bool counts = row.click.sampleRate == group.sampleRate &&
                        row.click.duration == group.duration && row.click.sampling == sampling;
    if (counts) worst = std::max(worst, row.worstError);
  }
  return std::isfinite(worst) ? formatted("%.1f", worst) : "-";
}

void printSummary(const std::vector<ErrorRow>& rows, const std::vector<Group>& groups) {
  std::printf("\nworst error in dB over pulses, radiations and places\n%-10s %8s %14s %8s\n",
              "contact", "kHz", "band_limited", "naive");
  for (const Group& group : groups) {
    std::printf("%-10s %8g %14s %8s\n", durationText(group.duration).c_str(),
                group.sampleRate / 1000.0, worstOf(rows, group, Sampling::bandLimited).c_str(),
                worstOf(rows, group, Sampling::naive).c_str());
  }
  std::printf("band-limited, above the bar of %.0f dB:", kBar);
  bool holds = true;
  for (const ErrorRow& row : rows) {
    if (row.click.sampling == Sampling::naive || row.worstError <= kBar) continue;
    std::printf("\n  %s, %s, %s at %g kHz: %.1f dB", row.pulse, nameOf(row.click.radiation),
                durationText(row.click.duration).c_str(), row.click.sampleRate / 1000.0,
                row.worstError);
    holds = false;
  }
  std::printf("%s\n", holds ? " none" : "");
}

void printOracle(const Scale& scale) {
  const std::span<const double> durations =
      scale.of<std::span<const double>>(kOracleDurations, std::span(kOracleDurations).first(2));
  std::printf(
      "\nthe closed-form spectrum against the click at 64 times 48 kHz, difference in dB\n"
      "%-18s %-9s",
      "pulse", "radiation");
  for (const double duration : durations)
    std::printf(" %8s", durationText(duration).c_str());
  std::printf("\n");
  for (const NamedPulse& pulse : kPulses) {
    for (const Radiation radiation : {Radiation::exact, Radiation::compact}) {
      std::printf("%-18s %-9s", pulse.name, nameOf(radiation));
      for (const double duration : durations) {
        ClickCase click = clickOf(pulse, duration, 48000.0);
        click.radiation = radiation;
        std::printf(" %8.1f", oversampledDifference(click));
      }
      std::printf("\n");
    }
  }
  std::fflush(stdout);
}

bool writeCsv(const char* path, const std::vector<ErrorRow>& rows) {
  std::FILE* const file = std::fopen(path, "w");
  if (file == nullptr) return false;
  std::fprintf(file,
               "sample_rate_hz,duration_s,pulse,sampling,radiation,radius_m,distance_m,"
               "worst_error_db,worst_place_samples,impulse_spread_percent,energy_spread_db,"
               "level_against_hertz_db,difference_from_hertz_db,compact_from_exact_db,cost_ns\n");
  for (const ErrorRow& row : rows) {
    const ClickCase& click = row.click;
    std::fprintf(file, "%g,%g,%s,%s,%s,%.6g,%.6g,%.2f,%.4f,%.4g,%.4g,%.4f,%s,%.1f,%.1f\n",
                 click.sampleRate, click.duration, row.pulse, nameOf(click.sampling),
                 nameOf(click.radiation), click.radius, click.distance, row.worstError,
                 row.worstPlace, 100.0 * row.impulseSpread, row.energySpread, row.level,
                 differenceText(row.shape, "").c_str(), row.model, row.cost);
  }
  return std::fclose(file) == 0;
}

std::vector<Group> allGroups(const Scale& scale) {
  const std::span<const double> durations =
      scale.of<std::span<const double>>(kDurations, kFewDurations);
  std::vector<Group> groups;
  for (const double duration : durations)
    groups.push_back({.duration = duration});
  for (const double sampleRate : {8000.0, 192000.0}) {
    for (const double duration : durations)
      groups.push_back({.sampleRate = sampleRate, .duration = duration, .isReduced = true});
  }
  return groups;
}

int run(const char* csv, const Scale& scale) {
  const std::vector<Group> groups = allGroups(scale);
  std::vector<ErrorRow> rows;
  for (const Group& group : groups) {
    const std::vector<ErrorRow> measured = measure(group);
    printGroup(measured);
    rows.insert(rows.end(), measured.begin(), measured.end());
  }
  printSummary(rows, groups);
  printOracle(scale);
  if (csv == nullptr || writeCsv(csv, rows)) return 0;
  std::fprintf(stderr, "bench_acceleration_noise_error: cannot write %s: %s\n", csv,
               std::strerror(errno));
  return 1;
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  const char* csv = nullptr;
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument == "--help") {
      std::fputs(carom::bench::kHelp, stdout);
      return 0;
    }
    if (argument == "--short") continue;
    if (argument != "--csv" || i + 1 == argc) {
      std::fprintf(stderr, "bench_acceleration_noise_error: what is '%s'?\n\n%s", argv[i],
                   carom::bench::kHelp);
      return 2;
    }
    csv = argv[++i];
  }
  return carom::bench::run(csv, carom::bench::scaleOf(argc, argv));
}
