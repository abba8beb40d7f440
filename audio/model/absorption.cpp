#include "carom/audio/absorption.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <utility>

namespace carom {
namespace {

using Bands = std::array<double, kBandCount>;

/// Surfaces with their absorption coefficients by band. Most rows are from M. Vorlaender,
/// Auralization (Springer 2008), annex "Material data", tables of absorption coefficients; checked
/// against the transcription in the documentation of pyroomacoustics (materials database), not
/// against the printed page.
/// Barron: R. F. Barron, Industrial Noise Control and Acoustics (Marcel Dekker 2003), appendix D.
constexpr std::array<Surface, 26> kSurfaces = {{
    {"rigid", {{0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0}}, "definition: nothing is absorbed"},
    {"open", {{1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0}}, "definition: Sabine's open window"},
    {"concrete",
     {{0.01, 0.01, 0.02, 0.02, 0.02, 0.05, 0.05}},
     "Vorlaender 2008, annex: smooth unpainted concrete"},
    {"rough_concrete",
     {{0.02, 0.03, 0.03, 0.03, 0.04, 0.07, 0.07}},
     "Vorlaender 2008, annex: rough concrete"},
    {"brick",
     {{0.03, 0.03, 0.03, 0.04, 0.05, 0.07, 0.07}},
     "Barron 2003, appendix D: brick, unglazed; to 4 kHz"},
    {"painted_brick",
     {{0.01, 0.01, 0.02, 0.02, 0.02, 0.02, 0.02}},
     "Vorlaender 2008, annex: smooth brickwork with flush pointing, painted"},
    {"concrete_block",
     {{0.36, 0.44, 0.31, 0.29, 0.39, 0.25, 0.25}},
     "Barron 2003, appendix D: concrete block, unpainted; to 4 kHz"},
    {"plaster",
     {{0.013, 0.015, 0.02, 0.03, 0.04, 0.05, 0.05}},
     "Barron 2003, appendix D: plaster, gypsum or lime, on tile or brick; to 4 kHz"},
    {"plasterboard",
     {{0.15, 0.10, 0.06, 0.04, 0.04, 0.05, 0.05}},
     "Vorlaender 2008, annex: two 13 mm plasterboards on steel frame, mineral wool in the cavity, "
     "painted"},
    {"wood_floor",
     {{0.10, 0.07, 0.06, 0.06, 0.06, 0.06, 0.06}},
     "Vorlaender 2008, annex: stage floor, two layers of 27 mm over airspace; to 4 kHz"},
    {"wood_panel",
     {{0.27, 0.23, 0.22, 0.15, 0.10, 0.07, 0.06}},
     "Vorlaender 2008, annex: wooden lining, 12 mm, on frame"},
    {"wood_door",
     {{0.14, 0.10, 0.06, 0.08, 0.10, 0.10, 0.10}},
     "Vorlaender 2008, annex: solid wooden door"},
    {"linoleum",
     {{0.02, 0.03, 0.03, 0.03, 0.03, 0.02, 0.02}},
     "Vorlaender 2008, annex: linoleum, asphalt, rubber or cork tile on concrete; to 4 kHz"},
    {"ceramic_tile",
     {{0.01, 0.01, 0.01, 0.02, 0.02, 0.02, 0.02}},
     "Vorlaender 2008, annex: ceramic tiles with a smooth surface"},
    {"marble",
     {{0.01, 0.01, 0.01, 0.02, 0.02, 0.02, 0.02}},
     "Vorlaender 2008, annex: marble floor"},
    {"glass",
     {{0.08, 0.04, 0.03, 0.03, 0.02, 0.02, 0.02}},
     "Vorlaender 2008, annex: single pane of glass, 3 mm"},
    {"carpet",
     {{0.02, 0.04, 0.08, 0.20, 0.35, 0.40, 0.40}},
     "Vorlaender 2008, annex: thin carpet, cemented to concrete; to 4 kHz"},
    {"carpet_on_felt",
     {{0.08, 0.08, 0.30, 0.60, 0.75, 0.80, 0.80}},
     "Vorlaender 2008, annex: 9 mm tufted pile carpet on felt underlay"},
    {"curtain",
     {{0.30, 0.45, 0.65, 0.56, 0.59, 0.71, 0.71}},
     "Vorlaender 2008, annex: cotton curtains, 0.5 kg/m2, draped to 3/4 area, 130 mm from wall"},
    {"velvet",
     {{0.05, 0.12, 0.35, 0.45, 0.38, 0.36, 0.36}},
     "Vorlaender 2008, annex: tight velvet curtains"},
    {"acoustic_tile",
     {{0.49, 0.53, 0.53, 0.75, 0.92, 0.99, 0.99}},
     "Vorlaender 2008, annex: fissured ceiling tile; to 4 kHz"},
    {"acoustic_plaster",
     {{0.17, 0.36, 0.66, 0.65, 0.62, 0.68, 0.68}},
     "Vorlaender 2008, annex: acoustical plaster, 25 mm; to 4 kHz"},
    {"mineral_wool",
     {{0.22, 0.60, 0.92, 0.90, 0.88, 0.88, 0.88}},
     "Vorlaender 2008, annex: rockwool, 50 mm, 80 kg/m3"},
    {"melamine_foam",
     {{0.12, 0.33, 0.83, 0.97, 0.98, 0.95, 0.95}},
     "Vorlaender 2008, annex: wedge-shaped melamine foam ceiling tile; to 4 kHz"},
    {"seats",
     {{0.49, 0.66, 0.80, 0.88, 0.82, 0.70, 0.70}},
     "Vorlaender 2008, annex: medium upholstered concert chairs, empty; to 4 kHz"},
    {"audience",
     {{0.26, 0.46, 0.87, 0.99, 0.99, 0.99, 0.99}},
     "Vorlaender 2008, annex: audience area, 2 persons per m2; to 4 kHz"},
}};

struct Default {
  std::string_view material;
  std::string_view surface;
};

constexpr std::array<Default, 8> kDefaults = {{
    {"steel", "marble"},
    {"ceramic", "ceramic_tile"},
    {"glass", "glass"},
    {"plastic", "linoleum"},
    {"wood", "wood_floor"},
    {"concrete", "concrete"},
    {"rubber", "linoleum"},
    {"aluminium", "marble"},
}};

constexpr double kHighestBand = 0.45;    // share of the sample rate
constexpr double kSmallestPower = 0.01;  // -20 dB: below it an error in dB says little

double reflectedPower(double alpha) {
  return std::max(1.0 - alpha, kSmallestPower);
}

std::size_t usableBands(double sampleRate) {
  const auto past = std::ranges::upper_bound(kOctaveBands, kHighestBand * sampleRate);
  return static_cast<std::size_t>(past - kOctaveBands.begin());
}

/// tan(omega / 2): the frequency of the analogue prototype under the bilinear transform.
double warped(double frequency, double sampleRate) {
  return std::tan(std::numbers::pi * frequency / sampleRate);
}

/// A first-order fit: alpha(f) = atZero + (atNyquist - atZero) u(f).
struct Fit {
  double corner = 1.0;  // warped
  double atZero = 0.0;
  double atNyquist = 0.0;

  double alpha(double x) const {
    const double square = (x / corner) * (x / corner);
    return atZero + (atNyquist - atZero) * square / (1.0 + square);
  }
};

/// Least squares of alpha = atZero (1 - u) + atNyquist u over the bands, both in [0, 1].
class LinearFit {
 public:
  void add(double u, double alpha) {
    const double weight = 1.0 / (reflectedPower(alpha) * reflectedPower(alpha));
    const double v = 1.0 - u;
    vv_ += weight * v * v;
    uv_ += weight * u * v;
    uu_ += weight * u * u;
    va_ += weight * v * alpha;
    ua_ += weight * u * alpha;
  }

  std::pair<double, double> solve() const {
    const double determinant = vv_ * uu_ - uv_ * uv_;
    if (determinant <= 1e-12 * vv_ * uu_) return flat();
    const double zero = (va_ * uu_ - ua_ * uv_) / determinant;
    const double nyquist = (ua_ * vv_ - va_ * uv_) / determinant;
    if (inside(zero) && inside(nyquist)) return {zero, nyquist};
    return best(edge(zero), nyquist, zero, edge(nyquist));
  }

 private:
  static bool inside(double value) { return value >= 0.0 && value <= 1.0; }
  static double edge(double value) { return std::clamp(value, 0.0, 1.0); }

  std::pair<double, double> flat() const {
    const double mean = edge((va_ + ua_) / (vv_ + 2.0 * uv_ + uu_));
    return {mean, mean};
  }
  /// Returns the optimum on the edge of [0, 1]^2 that was crossed, or on the better of two edges.
  std::pair<double, double> best(double zero, double freeNyquist, double freeZero,
                                 double nyquist) const {
    const std::pair<double, double> atZeroEdge = {zero, edge((ua_ - uv_ * zero) / uu_)};
    const std::pair<double, double> atNyquistEdge = {edge((va_ - uv_ * nyquist) / vv_), nyquist};
    if (inside(freeNyquist)) return atZeroEdge;
    if (inside(freeZero)) return atNyquistEdge;
    return cost(atZeroEdge) <= cost(atNyquistEdge) ? atZeroEdge : atNyquistEdge;
  }
  double cost(const std::pair<double, double>& at) const {
    const auto [zero, nyquist] = at;
    return vv_ * zero * zero + 2.0 * uv_ * zero * nyquist + uu_ * nyquist * nyquist -
           2.0 * (va_ * zero + ua_ * nyquist);
  }

  double vv_ = 0.0, uv_ = 0.0, uu_ = 0.0, va_ = 0.0, ua_ = 0.0;
};

Fit fitAt(double corner, const Absorption& absorption, double sampleRate) {
  LinearFit sums;
  for (std::size_t band = 0; band < usableBands(sampleRate); ++band) {
    const double x = warped(kOctaveBands[band], sampleRate) / corner;
    sums.add(x * x / (1.0 + x * x), absorption.coefficients[band]);
  }
  const auto [atZero, atNyquist] = sums.solve();
  return {corner, atZero, atNyquist};
}

/// Sum over the bands of the squared logarithm of the ratio of the reflected powers.
double logError(const Fit& fit, const Absorption& absorption, double sampleRate) {
  double sum = 0.0;
  for (std::size_t band = 0; band < usableBands(sampleRate); ++band) {
    const double alpha = fit.alpha(warped(kOctaveBands[band], sampleRate));
    const double ratio = reflectedPower(alpha) / reflectedPower(absorption.coefficients[band]);
    sum += std::log(ratio) * std::log(ratio);
  }
  return sum;
}

/// Returns the best of the fits with corners from below the lowest band to above the highest,
/// eight to the octave.
Fit bestFit(const Absorption& absorption, double sampleRate) {
  constexpr double kLowest = 44.0;  // Hz
  const double highest = kHighestBand * sampleRate;
  Fit best = fitAt(warped(kLowest, sampleRate), absorption, sampleRate);
  double smallest = logError(best, absorption, sampleRate);
  const int steps = static_cast<int>(8.0 * std::log2(highest / kLowest));
  for (int step = 1; step <= steps; ++step) {
    const double corner = kLowest * std::exp2(step / 8.0);
    const Fit fit = fitAt(warped(corner, sampleRate), absorption, sampleRate);
    const double error = logError(fit, absorption, sampleRate);
    if (error < smallest) {
      smallest = error;
      best = fit;
    }
  }
  return best;
}

}  // namespace

bool isValid(const Absorption& absorption) {
  return std::ranges::all_of(absorption.coefficients,
                             [](double alpha) { return alpha >= 0.0 && alpha <= 1.0; });
}

double absorptionAt(const Absorption& absorption, double frequency) {
  const Bands& alpha = absorption.coefficients;
  if (!(frequency > kOctaveBands.front())) return alpha.front();
  if (frequency >= kOctaveBands.back()) return alpha.back();
  const auto above = std::ranges::upper_bound(kOctaveBands, frequency);
  const auto band = static_cast<std::size_t>(above - kOctaveBands.begin());
  const double low = kOctaveBands[band - 1];
  const double along = std::log(frequency / low) / std::log(kOctaveBands[band] / low);
  return alpha[band - 1] + along * (alpha[band] - alpha[band - 1]);
}

double reflectionMagnitude(const Absorption& absorption, double frequency) {
  return std::sqrt(1.0 - absorptionAt(absorption, frequency));
}

std::span<const Surface> surfaceTable() {
  return kSurfaces;
}

const Surface* findSurface(std::string_view name) {
  const auto row = std::ranges::find(kSurfaces, name, &Surface::name);
  return row == kSurfaces.end() ? nullptr : &*row;
}

const Surface* defaultSurface(std::string_view material) {
  const auto row = std::ranges::find(kDefaults, material, &Default::material);
  return row == kDefaults.end() ? nullptr : findSurface(row->surface);
}

ReflectionFilter reflectionFilter(const Absorption& absorption, double sampleRate) {
  assert(isValid(absorption) && sampleRate >= 1000.0);
  const Fit fit = bestFit(absorption, sampleRate);
  const double atZero = std::sqrt(1.0 - fit.atZero);
  const double atNyquist = std::sqrt(1.0 - fit.atNyquist);
  const double scale = 1.0 / (1.0 + fit.corner);
  return {(atZero * fit.corner + atNyquist) * scale, (atZero * fit.corner - atNyquist) * scale,
          (fit.corner - 1.0) * scale};
}

std::complex<double> frequencyResponse(const ReflectionFilter& filter, double frequency,
                                       double sampleRate) {
  const std::complex<double> delay =
      std::polar(1.0, -2.0 * std::numbers::pi * frequency / sampleRate);
  return (filter.b0 + filter.b1 * delay) / (1.0 + filter.a1 * delay);
}

double reflectionFitError(const Absorption& absorption, const ReflectionFilter& filter,
                          double sampleRate) {
  double largest = 0.0;
  for (std::size_t band = 0; band < usableBands(sampleRate); ++band) {
    const double power = std::norm(frequencyResponse(filter, kOctaveBands[band], sampleRate));
    const double ratio =
        std::max(power, kSmallestPower) / reflectedPower(absorption.coefficients[band]);
    largest = std::max(largest, std::abs(10.0 * std::log10(ratio)));
  }
  return largest;
}

}  // namespace carom
