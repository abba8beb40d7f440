#include "audio/dsp/decay_filter.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace carom::audio {
namespace {

using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, static_cast<int>(kBandCount), 1>;
using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0,
                             static_cast<int>(kBandCount), static_cast<int>(kBandCount)>;

constexpr double kHighestBand = 0.45;  // share of the sample rate
constexpr double kLeastGain = -120.0;  // dB per pass: a filter is not asked for less
constexpr double kSteepest = 60.0;     // dB per shelf: keeps its pole away from the unit circle
constexpr double kSlowest = 0.6;       // see decayCascade
constexpr int kIterations = 30;
constexpr double kSmoothest = 1e3;  // largest smoothing: beyond it, one gain for all bands
constexpr double kLeastPart = 0.1;  // of a band's decay: what is left to the shelves at least
constexpr std::size_t kMostTopSections = 4;
constexpr double kFullSection = 0.9;  // share of what a section can take that one is asked for
constexpr int kTopIterations = 6;

double warped(double frequency, double sampleRate) {
  return std::tan(std::numbers::pi * frequency / sampleRate);
}

double amplitude(double decibel) {
  return std::pow(10.0, decibel / 20.0);
}

/// Finds the gains of the shelves. gains[0]: dB at 0 Hz; gains[k]: dB, what shelf k adds above the
/// edge between bands k-1 and k.
class CascadeDesign {
 public:
  CascadeDesign(double samples, const DecayTimes& times, double sampleRate)
      : sampleRate_(sampleRate) {
    const auto past = std::ranges::upper_bound(kOctaveBands, kHighestBand * sampleRate);
    bands_ = past - kOctaveBands.begin();
    targets_.resize(bands_);
    for (Eigen::Index band = 0; band < bands_; ++band) {
      const double time = times[static_cast<std::size_t>(band)];
      targets_[band] = std::max(-60.0 * samples / (sampleRate * time), kLeastGain);
    }
    linearise();
  }

  /// Has the shelves leave to `decibel`, what others take at a frequency, their part of the bands.
  template <class Decibel>
  void leaveTo(const Decibel& decibel, const Vector& all) {
    for (Eigen::Index band = 0; band < bands_; ++band)
      targets_[band] = std::min(all[band] - decibel(centre(band)), kLeastPart * all[band]);
  }
  const Vector& targets() const { return targets_; }

  Vector solve() const {
    double smoothing = 0.0;
    while (smoothing <= kSmoothest) {
      Vector gains = fit(smoothing);
      if (isModerate(gains) && decaysEverywhere(gains)) return gains;
      smoothing = std::max(1e-4, 2.0 * smoothing);
    }
    Vector flat = Vector::Zero(bands_);
    flat[0] = targets_.maxCoeff();
    return flat;
  }

  /// dB that shelves with these gains leave at a frequency (Hz).
  double leaves(const Vector& gains, double frequency) const {
    return gainAt(gains, warped(frequency, sampleRate_));
  }

  std::vector<ReflectionFilter> make(const Vector& gains) const {
    std::vector<ReflectionFilter> cascade;
    for (Eigen::Index shelf = 1; shelf < bands_; ++shelf) {
      cascade.push_back(makeShelf(edge(shelf), gains[shelf]));
    }
    cascade.front().b0 *= amplitude(gains[0]);
    cascade.front().b1 *= amplitude(gains[0]);
    return cascade;
  }

 private:
  static double centre(Eigen::Index band) { return kOctaveBands[static_cast<std::size_t>(band)]; }
  /// Warped frequency of the edge between bands shelf - 1 and shelf.
  double edge(Eigen::Index shelf) const {
    return warped(std::sqrt(centre(shelf - 1) * centre(shelf)), sampleRate_);
  }

  /// (1 + sqrt(G) s) / (1 + s / sqrt(G)): 1 at 0 Hz, G far above the edge, sqrt(G) on it.
  static ReflectionFilter makeShelf(double edge, double decibel) {
    const double root = amplitude(decibel / 2.0);
    const double zero = root / edge;
    const double pole = 1.0 / (root * edge);
    return {(1.0 + zero) / (1.0 + pole), (1.0 - zero) / (1.0 + pole), (1.0 - pole) / (1.0 + pole)};
  }

  static double shelfGain(double edge, double decibel, double x) {
    const double root = amplitude(decibel / 2.0);
    const double zero = root * x / edge;
    const double pole = x / (root * edge);
    return 10.0 * std::log10((1.0 + zero * zero) / (1.0 + pole * pole));
  }

  double gainAt(const Vector& gains, double x) const {
    double sum = gains[0];
    for (Eigen::Index shelf = 1; shelf < bands_; ++shelf) {
      sum += shelfGain(edge(shelf), gains[shelf], x);
    }
    return sum;
  }

  /// Sets slope_ to the derivative at gains of 0 dB: at x times its edge, a shelf adds
  /// x^2 / (1 + x^2) of its gain.
  void linearise() {
    slope_ = Matrix::Ones(bands_, bands_);
    for (Eigen::Index band = 0; band < bands_; ++band) {
      for (Eigen::Index shelf = 1; shelf < bands_; ++shelf) {
        const double x = warped(centre(band), sampleRate_) / edge(shelf);
        slope_(band, shelf) = x * x / (1.0 + x * x);
      }
    }
  }

  Vector fit(double smoothing) const {
    Matrix penalty = smoothing * Matrix::Identity(bands_, bands_);
    penalty(0, 0) = 0.0;
    const Matrix normal = slope_.transpose() * slope_ + penalty;
    const Eigen::LDLT<Matrix> factors(normal);
    Vector gains = Vector::Zero(bands_);
    for (int iteration = 0; iteration < kIterations; ++iteration) {
      const Vector right = slope_.transpose() * missing(gains) - penalty * gains;
      gains += factors.solve(right);
    }
    return gains;
  }

  Vector missing(const Vector& gains) const {
    Vector rest = targets_;
    for (Eigen::Index band = 0; band < bands_; ++band) {
      rest[band] -= gainAt(gains, warped(centre(band), sampleRate_));
    }
    return rest;
  }

  bool isModerate(const Vector& gains) const {
    return gains.tail(bands_ - 1).cwiseAbs().maxCoeff() <= kSteepest;
  }

  bool decaysEverywhere(const Vector& gains) const {
    const double limit = kSlowest * targets_.maxCoeff();
    // First 0 Hz and half the sample rate, then points between.
    if (!(gains[0] <= limit && gains.sum() <= limit)) return false;
    constexpr int kPoints = 256;
    for (int point = 0; point <= kPoints; ++point) {
      const double frequency = 10.0 * std::pow(0.0499 * sampleRate_, 1.0 * point / kPoints);
      if (!(gainAt(gains, warped(frequency, sampleRate_)) <= limit)) return false;
    }
    return true;
  }

  double sampleRate_;
  Eigen::Index bands_ = 0;
  Vector targets_;  // dB at the centres
  Matrix slope_;    // band by gain
};

/// dB that one section (1 + r z^-1) / (1 + r) leaves at a frequency (Hz).
double topGain(double r, double frequency, double sampleRate) {
  const double cosine = std::cos(2.0 * std::numbers::pi * frequency / sampleRate);
  return 10.0 * std::log10((1.0 + 2.0 * r * cosine + r * r) / ((1.0 + r) * (1.0 + r)));
}

/// Returns the r with which a section leaves `decibel` at kTopBand; 1 if none leaves so little.
double topZero(double decibel, double sampleRate) {
  double low = 0.0;
  double high = 1.0;
  for (int halving = 0; halving < 40; ++halving) {
    const double middle = 0.5 * (low + high);
    (topGain(middle, kTopBand, sampleRate) > decibel ? low : high) = middle;
  }
  return high;
}

double topTarget(double samples, const TopDecay& decay, double sampleRate) {
  return std::max(-60.0 * samples / (sampleRate * decay.timeAt16kHz), kLeastGain);
}

}  // namespace

std::vector<ReflectionFilter> decayCascade(double samples, const DecayTimes& times,
                                           double sampleRate) {
  assert(samples > 0.0 && sampleRate >= 8000.0 && std::ranges::min(times) > 0.0);
  const CascadeDesign design(samples, times, sampleRate);
  return design.make(design.solve());
}

std::vector<ReflectionFilter> decayCascade(double samples, const TopDecay& decay,
                                           double sampleRate) {
  if (decay.topSections == 0) return decayCascade(samples, decay.times, sampleRate);
  CascadeDesign design(samples, decay.times, sampleRate);
  const Vector all = design.targets();
  const auto sections = static_cast<double>(decay.topSections);
  double r = 0.0;
  Vector gains = design.solve();
  for (int iteration = 0; iteration < kTopIterations; ++iteration) {
    const double rest =
        topTarget(samples, decay, sampleRate) - design.leaves(gains, kTopBand);  // dB
    r = topZero(std::min(rest, 0.0) / sections, sampleRate);
    design.leaveTo([&](double f) { return sections * topGain(r, f, sampleRate); }, all);
    gains = design.solve();
  }
  std::vector<ReflectionFilter> cascade = design.make(gains);
  cascade.insert(cascade.end(), decay.topSections, {1.0 / (1.0 + r), r / (1.0 + r), 0.0});
  return cascade;
}

std::size_t topSectionsFor(double samples, const TopDecay& decay, double sampleRate) {
  if (kTopBand > kHighestBand * sampleRate) return 0;
  const CascadeDesign design(samples, decay.times, sampleRate);
  const double rest =
      topTarget(samples, decay, sampleRate) - design.leaves(design.solve(), kTopBand);
  const double most = kFullSection * topGain(1.0, kTopBand, sampleRate);
  const double needed = std::ceil(std::max(0.0, rest / most));
  return std::min(static_cast<std::size_t>(needed), kMostTopSections);
}

double decayTimeOf(const std::vector<ReflectionFilter>& cascade, double samples, double frequency,
                   double sampleRate) {
  double logarithm = 0.0;
  for (const ReflectionFilter& filter : cascade) {
    logarithm += std::log10(std::abs(frequencyResponse(filter, frequency, sampleRate)));
  }
  if (logarithm == 0.0) return std::numeric_limits<double>::infinity();
  return -3.0 * samples / (sampleRate * logarithm);
}

}  // namespace carom::audio
