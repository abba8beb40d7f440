#include "audio/dsp/sinc_kernel.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace carom::audio {
namespace {

constexpr double kPointsPerSample = 512.0;

/// Modified Bessel function of the first kind and order zero, by its power series.
double besselI0ForWindow(double x) {
  double term = 1.0;
  double sum = 1.0;
  for (int power = 1; term > 1e-17 * sum; ++power) {
    const double half = 0.5 * x / power;
    term *= half * half;
    sum += term;
  }
  return sum;
}

double sinc(double x) {
  const double angle = std::numbers::pi * x;
  return angle == 0.0 ? 1.0 : std::sin(angle) / angle;
}

}  // namespace

SincKernel::SincKernel(std::size_t halfWidth, double cutoff, double beta)
    : halfWidth_(halfWidth),
      table_(halfWidth * static_cast<std::size_t>(kPointsPerSample) + 2, 0.0) {
  const double end = static_cast<double>(halfWidth);
  for (std::size_t point = 0; point + 2 < table_.size(); ++point) {
    const double x = static_cast<double>(point) / kPointsPerSample;
    const double window =
        besselI0ForWindow(beta * std::sqrt(1.0 - (x / end) * (x / end))) / besselI0ForWindow(beta);
    table_[point] = cutoff * sinc(cutoff * x) * window;
  }
}

double SincKernel::operator()(double x) const noexcept {
  const double place = std::abs(x) * kPointsPerSample;
  if (!(place < static_cast<double>(table_.size() - 2))) return 0.0;
  const auto point = static_cast<std::size_t>(place);
  const double part = place - static_cast<double>(point);
  return table_[point] + part * (table_[point + 1] - table_[point]);
}

}  // namespace carom::audio
