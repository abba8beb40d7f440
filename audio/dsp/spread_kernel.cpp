#include "audio/dsp/spread_kernel.h"

#include <cmath>
#include <numbers>

#include "audio/model/bessel.h"

namespace carom::audio {
namespace {

// Cut-off and beta were chosen by a search over both for the least that folds back, with the
// dimming that they cost.
constexpr double kCutOff = 0.30;  // cycles per sample
constexpr double kBeta = 14.0;

/// Integral of the kernel times an even function, by Simpson's rule over half of the kernel: exact
/// to 1e-12 of the transform at 0 Hz.
template <class Function>
auto integral(const Function& of) {
  constexpr std::size_t kSteps = 512;
  constexpr double kStep = kSpreadHalfWidth / kSteps;
  static const auto values = [] {
    std::array<double, kSteps + 1> kernel{};
    for (std::size_t i = 0; i <= kSteps; ++i)
      kernel[i] = spreadKernel(static_cast<double>(i) * kStep);
    return kernel;
  }();
  decltype(of(0.0)) sum = 0.0;
  for (std::size_t i = 0; i <= kSteps; ++i) {
    const double weight = i == 0 || i == kSteps ? 1.0 : (i % 2 == 1 ? 4.0 : 2.0);
    sum += weight * values[i] * of(static_cast<double>(i) * kStep);
  }
  return 2.0 * sum * kStep / 3.0;
}

}  // namespace

double spreadKernel(double t) {
  const double inside = 1.0 - (t / kSpreadHalfWidth) * (t / kSpreadHalfWidth);
  if (inside < 0.0) return 0.0;
  static const double scale = 1.0 / (besselI0(kBeta) - 1.0);
  const double angle = 2.0 * std::numbers::pi * kCutOff * t;
  const double cardinal = angle == 0.0 ? 1.0 : std::sin(angle) / angle;
  // The window's value at its edge is subtracted: else, with the edge on a sample, rounding would
  // decide whether it counts.
  return scale * (besselI0(kBeta * std::sqrt(inside)) - 1.0) * cardinal;
}

double spreadTransform(double frequency) {
  return integral(
      [frequency](double t) { return std::cos(2.0 * std::numbers::pi * frequency * t); });
}

std::complex<double> spreadTransform(std::complex<double> s) {
  return integral([s](double t) { return std::cosh(s * t); });
}

const SpreadTable& SpreadTable::instance() {
  static const SpreadTable table;
  return table;
}

SpreadTable::SpreadTable() {
  for (std::size_t phase = 0; phase <= kPhases; ++phase) {
    for (std::size_t m = 0; m < kSpreadWidth; ++m) {
      const double from = static_cast<double>(phase) / static_cast<double>(kPhases);
      rows_[phase * kStride + m] = spreadKernel(from + static_cast<double>(m) - kSpreadHalfWidth);
    }
  }
}

}  // namespace carom::audio
