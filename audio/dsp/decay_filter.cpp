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

  std::vector<ReflectionFilter> make() const {
    const Vector gains = solve();
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

}  // namespace

std::vector<ReflectionFilter> decayCascade(double samples, const DecayTimes& times,
                                           double sampleRate) {
  assert(samples > 0.0 && sampleRate >= 8000.0 && std::ranges::min(times) > 0.0);
  return CascadeDesign(samples, times, sampleRate).make();
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
