// Round trip of `carom fit`: objects and materials at random, taps synthesised from an analysis of
// more unknowns in another orientation, fitted with the mesh, and with another object's mesh.
//
//     round_trip [--short] [--list] [--objects N] [--first N] [--reference DOFS] [--cache FOLDER]
//                [--taps FOLDER]
//
// Prints a row for each object and the counts; docs/fit.md has what came out. Exit code 1 if a bar
// of --short is missed.

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "lab/fit/tap_fit.h"
#include "lab/fit/tap_recording.h"
#include <Eigen/Geometry>
#include <unsupported/Eigen/FFT>

#include "carom/modal/mesh_analysis.h"
#include "tests/fit/round_trip_objects.h"

namespace carom::test {
namespace {

using namespace lab;

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kSeconds = 3.0;
constexpr double kOnset = 0.6;     // s
constexpr std::size_t kOther = 3;  // objects further: another kind, whose mesh must be refused

struct RoundTripOptions {
  std::size_t first = 0;
  std::size_t objects = 50;
  std::size_t reference = 20000;  // degrees of freedom
  std::string cache = "build/round_trip_cache";
  bool isShort = false;
  bool isListed = false;  // print all modes
};

/// A mode of the reference as it is in the tap.
struct TrueMode {
  double frequency = 0.0;
  double decay = 0.0;
  double amplitude = 0.0;
};

SurfaceMesh turned(const SurfaceMesh& mesh, ObjectDice& dice) {
  const Eigen::AngleAxisd turn(dice.between(0.4, 2.7),
                               Vec3(dice.normal(), dice.normal(), dice.normal()).normalized());
  return mapped(mesh, [&](const Vec3& vertex) -> Vec3 { return turn * vertex; });
}

std::vector<TrueMode> trueModes(const RoundTripObject& object, std::size_t dofs, ObjectDice& dice,
                                ModelCache& cache) {
  MeshAnalysisSettings settings;
  settings.solid.grid.degreesOfFreedom = dofs;
  settings.radiation->panels = 400;
  const auto analysis =
      analyseMesh(turned(object.mesh, dice), object.material, settings, &cache, {});
  std::vector<TrueMode> modes;
  if (!analysis) {
    std::printf("%s\n", analysis.error().message.c_str());
    return modes;
  }
  const ModalModel& model = analysis->model;
  const std::size_t place = dice.below(model.surface.vertices.size());
  const Vec3 blow = Vec3(dice.normal(), dice.normal(), dice.normal()).normalized();
  const double corner = dice.between(5000.0, 14000.0);  // Hz, of the hammer
  for (std::size_t mode = 0; mode < model.modes.size(); ++mode) {
    const Mode& one = model.modes[mode];
    TrueMode made;
    made.decay = object.materialDecay(one.frequency) + one.radiation.decayRate;
    made.frequency = std::sqrt(one.frequency * one.frequency - std::pow(made.decay / kTurn, 2));
    const double direction = std::hypot(dice.normal(), dice.normal()) / std::numbers::sqrt2;
    made.amplitude = std::abs(model.shape(mode, place).dot(blow)) *
                     std::sqrt(std::max(one.radiation.decayRate, 1e-6)) * direction *
                     std::exp(-std::pow(one.frequency / corner, 2));
    modes.push_back(made);
  }
  return modes;
}

std::vector<double> convolved(const std::vector<double>& signal, const std::vector<double>& with) {
  std::size_t size = 1;
  while (size < signal.size() + with.size())
    size *= 2;
  std::vector<double> one(size, 0.0);
  std::vector<double> other(size, 0.0);
  std::ranges::copy(signal, one.begin());
  std::ranges::copy(with, other.begin());
  Eigen::FFT<double> transform;
  std::vector<std::complex<double>> bins;
  std::vector<std::complex<double>> otherBins;
  transform.fwd(bins, one);
  transform.fwd(otherBins, other);
  for (std::size_t bin = 0; bin < bins.size(); ++bin)
    bins[bin] *= otherBins[bin];
  transform.inv(one, bins);
  one.resize(signal.size());
  return one;
}

/// Returns the impulse response of a room from near by: six early reflections, and a tail whose
/// energy is 10 to 18 dB below the direct sound's.
std::vector<double> roomResponse(double sampleRate, ObjectDice& dice) {
  const double reverberation = dice.between(0.2, 0.6);  // s, by 60 dB
  std::vector<double> response(static_cast<std::size_t>(reverberation * sampleRate), 0.0);
  double energy = 0.0;
  for (std::size_t at = static_cast<std::size_t>(0.008 * sampleRate); at < response.size(); ++at) {
    const double time = static_cast<double>(at) / sampleRate;
    response[at] = dice.normal() * std::exp(-6.9 * time / reverberation);
    energy += response[at] * response[at];
  }
  const double level = std::pow(10.0, -dice.between(10.0, 18.0) / 20.0) / std::sqrt(energy);
  for (double& sample : response)
    sample *= level;
  response[0] = 1.0;
  for (int reflection = 0; reflection < 6; ++reflection) {
    const double delay = dice.between(0.0015, 0.02);
    response[static_cast<std::size_t>(delay * sampleRate)] += dice.between(-0.25, 0.25);
  }
  return response;
}

std::vector<double> ringOf(const std::vector<TrueMode>& modes, double sampleRate,
                           ObjectDice& dice) {
  std::vector<double> ring(static_cast<std::size_t>(kSeconds * sampleRate), 0.0);
  double sum = 0.0;
  const auto first = static_cast<std::size_t>(kOnset * sampleRate);
  for (const TrueMode& mode : modes) {
    const double phase = dice.between(0.0, kTurn);
    sum += mode.amplitude;
    for (std::size_t at = first; at < ring.size(); ++at) {
      const double time = static_cast<double>(at - first) / sampleRate;
      const double decay = mode.decay * time;
      if (decay > 25.0) break;
      ring[at] +=
          mode.amplitude * std::exp(-decay) * std::sin(kTurn * mode.frequency * time + phase);
    }
  }
  const auto click = static_cast<std::size_t>(4e-4 * sampleRate);
  for (std::size_t at = 0; at < click; ++at)
    ring[first + at] +=
        0.3 * sum *
        std::cos(std::numbers::pi * static_cast<double>(at) / static_cast<double>(click));
  return ring;
}

std::vector<double> tapOf(const std::vector<TrueMode>& modes, double sampleRate, ObjectDice& dice) {
  std::vector<double> samples =
      convolved(ringOf(modes, sampleRate, dice), roomResponse(sampleRate, dice));
  double peak = 1e-30;
  for (const double sample : samples)
    peak = std::max(peak, std::abs(sample));
  const double clip = dice.between(0.0, 1.0) < 0.4 ? dice.between(1.1, 1.6) : 0.8;
  const double noise = std::pow(10.0, -dice.between(55.0, 65.0) / 20.0);
  const double hum = std::pow(10.0, -dice.between(45.0, 60.0) / 20.0);
  double rumble = 0.0;
  for (std::size_t at = 0; at < samples.size(); ++at) {
    const double time = static_cast<double>(at) / sampleRate;
    rumble = 0.97 * rumble + 0.2 * dice.normal();
    double value = samples[at] / peak * clip + noise * (dice.normal() + rumble);
    for (int harmonic = 1; harmonic <= 9; harmonic += 2)
      value += hum / harmonic * std::sin(kTurn * 50.02 * harmonic * time + harmonic);
    samples[at] = std::round(32767.0 * std::clamp(value, -1.0, 1.0)) / 32768.0;
  }
  return samples;
}

/// Prints the modes that were found beside the nearest true one.
void listModes(const TapModes& found, const std::vector<TrueMode>& modes) {
  double strongest = 1e-30;
  for (const TrueMode& mode : modes)
    strongest = std::max(strongest, mode.amplitude);
  for (const TapMode& mode : found.modes) {
    const auto nearest = std::ranges::min_element(
        modes, {}, [&](const TrueMode& one) { return std::abs(one.frequency - mode.frequency); });
    std::printf(
        "   %9.2f Hz %8.2f 1/s %6.1f dB, over noise %5.1f around %5.1f stable %.2f peak %d "
        "confidence %.2f | true %9.2f Hz %8.2f 1/s %6.1f dB\n",
        mode.frequency, mode.decayRate, mode.level, mode.overNoise, mode.overAround, mode.stability,
        mode.byPeak ? 1 : 0, mode.confidence, nearest->frequency, nearest->decay,
        20.0 * std::log10(nearest->amplitude / strongest));
  }
  for (const TrueMode& mode : modes)
    std::printf("   true %9.2f Hz %8.2f 1/s %6.1f dB\n", mode.frequency, mode.decay,
                20.0 * std::log10(mode.amplitude / strongest));
}

/// The results of one object.
struct RoundTripRow {
  bool isMade = false;
  bool isAccepted = false;
  double modulusOff = 0.0;  // 1
  std::size_t found = 0;
  std::size_t matched = 0;
  std::size_t clear = 0;       // modes 30 dB above the noise that the truth has
  std::size_t clearRight = 0;  // whose decay is within 10 %
  std::optional<bool> isOtherRefused;
};

void countDecays(RoundTripRow& row, const TapFit& fit, const std::vector<TrueMode>& modes) {
  for (const FittedMode& mode : fit.modes) {
    if (!mode.computed || mode.measured.overNoise < 30.0) continue;
    const auto nearest = std::ranges::min_element(modes, {}, [&](const TrueMode& one) {
      const double weak = one.amplitude > 0.0 ? 0.0 : 1.0;
      return std::abs(one.frequency - mode.measured.frequency) + weak;
    });
    if (std::abs(nearest->frequency / mode.measured.frequency - 1.0) > 5e-3) continue;
    ++row.clear;
    if (std::abs(mode.measured.decayRate / nearest->decay - 1.0) < 0.1) ++row.clearRight;
  }
}

RoundTripRow rowOf(std::size_t index, const RoundTripOptions& options, ModelCache& cache) {
  RoundTripRow row;
  const RoundTripObject object = roundTripObject(index);
  ObjectDice dice(static_cast<std::uint32_t>(7000 + index));
  const std::vector<TrueMode> modes = trueModes(object, options.reference, dice, cache);
  const double sampleRate = index % 3 == 0 ? 44100.0 : 48000.0;
  if (modes.size() < 4) return row;
  const auto tap = findTap(tapOf(modes, sampleRate, dice), sampleRate);
  if (!tap) return row;
  const auto found = tapModes({*tap});
  if (!found) return row;
  row.isMade = true;
  if (options.isListed) listModes(*found, modes);
  row.found = found->modes.size();
  TapFitSettings settings;
  settings.start = *findMaterial(object.material.name);  // what a user would say that it is
  settings.isStartKnown = true;
  settings.mass = object.material.density * signedVolume(object.mesh);
  settings.radiation.panels = 400;
  const auto fit = fitTap(found->modes, object.mesh, settings, &cache);
  if (!fit) return row;
  row.isAccepted = fit->accepted;
  row.matched = fit->match.matched;
  row.modulusOff = fit->material.youngsModulus / object.material.youngsModulus - 1.0;
  std::printf(
      "%2zu %-9s %-15s found %2zu matched %2zu explained %.2f chance %5.1f E %+6.2f %% nu %.3f "
      "(%.3f%s) %s",
      index, object.kind.c_str(), object.material.name.c_str(), row.found, row.matched,
      fit->match.explained, fit->match.chanceDistance, 100.0 * row.modulusOff,
      fit->material.poissonsRatio, object.material.poissonsRatio,
      fit->isPoissonFitted ? ", fitted" : "", fit->accepted ? "accepted" : "REFUSED");
  if (fit->accepted) countDecays(row, *fit, modes);
  std::printf(" decays %zu of %zu", row.clearRight, row.clear);
  const RoundTripObject other = roundTripObject((index + kOther) % 50);
  settings.mass = object.material.density * signedVolume(other.mesh);
  const auto wrong = fitTap(found->modes, other.mesh, settings, &cache);
  if (wrong) row.isOtherRefused = !wrong->accepted;
  if (wrong)
    std::printf("; %s: %s (%.2f, %.1f)\n", other.kind.c_str(),
                wrong->accepted ? "ACCEPTED" : "refused", wrong->match.explained,
                wrong->match.chanceDistance);
  std::fflush(stdout);
  return row;
}

int roundTrip(const RoundTripOptions& options) {
  ModelCache cache{std::filesystem::path(options.cache)};
  std::size_t made = 0;
  std::size_t accepted = 0;
  std::size_t modulusRight = 0;
  std::size_t others = 0;
  std::size_t refused = 0;
  std::size_t clear = 0;
  std::size_t clearRight = 0;
  for (std::size_t index = options.first; index < options.first + options.objects; ++index) {
    const RoundTripRow row = rowOf(index, options, cache);
    if (!row.isMade) std::printf("%2zu rings too little to be heard\n", index);
    made += row.isMade ? 1U : 0U;
    accepted += row.isAccepted ? 1U : 0U;
    modulusRight += row.isAccepted && std::abs(row.modulusOff) < 0.02 ? 1U : 0U;
    others += row.isOtherRefused ? 1U : 0U;
    refused += row.isOtherRefused.value_or(false) ? 1U : 0U;
    clear += row.clear;
    clearRight += row.clearRight;
  }
  std::printf(
      "taps with modes %zu of %zu; accepted %zu; E within 2 %%: %zu; decays within 10 %% at 30 dB: "
      "%zu of %zu; another object's mesh refused: %zu of %zu\n",
      made, options.objects, accepted, modulusRight, clearRight, clear, refused, others);
  if (!options.isShort) return 0;
  const bool isRight =
      10 * modulusRight >= 7 * made && 10 * clearRight >= 8 * clear && 10 * refused >= 8 * others;
  return isRight ? 0 : 1;
}

std::optional<RoundTripOptions> optionsOf(int argc, char** argv) {
  RoundTripOptions options;
  for (int at = 1; at < argc; ++at) {
    const std::string word = argv[at];
    if (word == "--short") {
      options.isShort = true;
      options.objects = 8;
      options.reference = 4000;
      continue;
    }
    if (word == "--list") {
      options.isListed = true;
      continue;
    }
    if (at + 1 >= argc) return {};
    const char* const value = argv[++at];
    if (word == "--objects")
      options.objects = std::strtoul(value, nullptr, 10);
    else if (word == "--first")
      options.first = std::strtoul(value, nullptr, 10);
    else if (word == "--reference")
      options.reference = std::strtoul(value, nullptr, 10);
    else if (word == "--cache")
      options.cache = value;
    else
      return {};
  }
  return options;
}

}  // namespace
}  // namespace carom::test

int main(int argc, char** argv) {
  const auto options = carom::test::optionsOf(argc, argv);
  if (!options) {
    std::printf(
        "round_trip [--short] [--list] [--objects N] [--first N] [--reference DOFS] [--cache "
        "FOLDER]\n");
    return 2;
  }
  return carom::test::roundTrip(*options);
}
