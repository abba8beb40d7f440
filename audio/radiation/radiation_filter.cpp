#include "audio/radiation/radiation_filter.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Dense>

#include "audio/dsp/spread_kernel.h"
#include "audio/model/immortal.h"

namespace carom::audio {
namespace {

using Complex = std::complex<double>;

constexpr int kFrequencies = 160;                               // in the fit, evenly over the band
constexpr Eigen::Index kRows = Eigen::Index{2} * kFrequencies;  // real and imaginary parts
// Weight of the taps' squares against those of the error: keeps the response beyond the band
// bounded.
constexpr double kDamping = 1e-13;
/// 1/samples: with a larger corner the recursion has nothing left after one sample.
constexpr double kInstant = 25.0;

double omegaOf(Eigen::Index row) {
  return 2.0 * std::numbers::pi * kBand * static_cast<double>(row) / (kFrequencies - 1);
}

// Finds the taps c that make  dimming(w) * sum c[k] e^{-i w (k + first)}  a given function of w, in
// the least squares sense: one matrix for all functions. Dimmed frequencies are fitted to the same
// relative error as others.
//
// The damping is a row for each tap below those of the frequencies. The normal equations would be
// smaller, but they square the condition number of 3e6: the last digits of the C library's sines
// and of the sums would decide what the filter does beyond the band, at -115 dB of its output.
class Fit {
 public:
  Fit(RadiationFilter::Input input, Eigen::Index taps) {
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(kRows + taps, taps);
    for (Eigen::Index row = 0; row < kFrequencies; ++row) {
      const double omega = omegaOf(row);
      const double dimming = input == RadiationFilter::Input::spread
                                 ? spreadTransform(omega / (2.0 * std::numbers::pi))
                                 : 1.0;
      for (Eigen::Index tap = 0; tap < taps; ++tap) {
        const double shift = static_cast<double>(tap + RadiationFilter::kFirstTap);
        const Complex at = dimming * std::polar(1.0, -omega * shift);
        matrix(2 * row, tap) = at.real();
        matrix(2 * row + 1, tap) = at.imag();
      }
    }
    matrix.bottomRows(taps).diagonal().setConstant(std::sqrt(kDamping * kFrequencies));
    inverse_ = matrix.householderQr().solve(Eigen::MatrixXd::Identity(matrix.rows(), kRows));
  }

  template <class Function>
  Eigen::VectorXd taps(const Function& wanted) const {
    Eigen::VectorXd values(kRows);
    for (Eigen::Index row = 0; row < kFrequencies; ++row) {
      const Complex value = wanted(omegaOf(row));
      values(2 * row) = value.real();
      values(2 * row + 1) = value.imag();
    }
    return inverse_ * values;
  }

 private:
  Eigen::MatrixXd inverse_;
};

// Returns the fit for an input and a number of taps; each is made once, when first needed.
const Fit& fitOf(RadiationFilter::Input input, std::size_t taps) {
  constexpr auto kAll = static_cast<Eigen::Index>(RadiationFilter::kTaps);
  if (input == RadiationFilter::Input::spread) {
    static const Fit& all = immortal([] { return Fit{RadiationFilter::Input::spread, kAll}; });
    static const Fit& oneLess = immortal([] {
      return Fit{RadiationFilter::Input::spread, kAll - 1};
    });
    return taps == RadiationFilter::kTaps ? all : oneLess;
  }
  static const Fit& all = immortal([] { return Fit{RadiationFilter::Input::bare, kAll}; });
  static const Fit& oneLess = immortal([] { return Fit{RadiationFilter::Input::bare, kAll - 1}; });
  return taps == RadiationFilter::kTaps ? all : oneLess;
}

// Returns (1 - e^{-z}) / z, the transform of a box of one sample.
Complex boxTransform(Complex z) {
  return std::abs(z) < 1e-5 ? 1.0 - 0.5 * z : (1.0 - std::exp(-z)) / z;
}

}  // namespace

RadiationResponse radiationResponse(double omega, double corner) {
  const Complex s{0.0, omega};
  const Complex ratio = s / corner;  // 0 for compact
  const Complex lowPass = 1.0 / (1.0 + ratio + 0.5 * ratio * ratio);
  const bool compact = std::isinf(corner);
  return {s * lowPass, compact ? Complex{0.0, 0.0} : lowPass};
}

RadiationFilter::RadiationFilter(double corner, Input input) {
  if (corner < kInstant) {
    *this = RadiationFilter(Complex(-corner, corner), input);
    return;
  }
  const auto lowPass = [corner](double omega) -> Complex {
    const Complex ratio = Complex{0.0, omega} / corner;
    return 1.0 / (1.0 + ratio + 0.5 * ratio * ratio);
  };
  fit(lowPass, input, !std::isinf(corner));
}

// The taps have the part of the response that the recursion does not have: the two poles'
// exponentials over one sample each, one after the other.
RadiationFilter::RadiationFilter(Complex pole, Input input)
    : b1_(2.0 * std::exp(pole.real()) * std::cos(pole.imag())), b2_(-std::exp(2.0 * pole.real())) {
  const auto numerator = [pole](double omega) -> Complex {
    const Complex s{0.0, omega};
    return std::norm(pole) * boxTransform(s - pole) * boxTransform(s - std::conj(pole));
  };
  fit(numerator, input, true);
}

// The far part is s times the numerator. It is fitted over the transform of a difference between
// samples, which is applied afterwards and exact: so a long pulse, all of it at low frequencies, is
// as exact as a short one.
template <class Numerator>
void RadiationFilter::fit(const Numerator& numerator, Input input, bool hasNear) {
  const auto slope = [&](double omega) -> Complex {
    return numerator(omega) / boxTransform(Complex{0.0, omega});
  };
  const Eigen::VectorXd far = fitOf(input, kTaps - 1).taps(slope);
  for (std::size_t tap = 0; tap + 1 < kTaps; ++tap) {
    const double value = far(static_cast<Eigen::Index>(tap));
    far_.first()[tap] += value;
    far_.first()[tap + 1] -= value;
  }
  if (!hasNear) return;
  const Eigen::VectorXd near = fitOf(input, kTaps).taps(numerator);
  std::copy(near.begin(), near.end(), near_.first());
}

}  // namespace carom::audio
