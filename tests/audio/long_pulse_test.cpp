#include "audio/synthesis/long_pulse.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include <gtest/gtest.h>

#include "audio/dsp/spread_kernel.h"

namespace carom {

using namespace audio;

namespace {

using Complex = std::complex<double>;

struct Edge {
  EdgeKind kind;
  double exponent;
};

constexpr Edge kEdges[] = {{EdgeKind::corner, 1.0},
                           {EdgeKind::root, 1.5},
                           {EdgeKind::parabola, 2.0},
                           {EdgeKind::cubic, 3.0}};

/// An edge that fades out so slowly that nothing but the edge itself is rough.
double fadingEdge(double exponent, double time) {
  return std::pow(time, exponent) * std::exp(-1e-3 * time * time);
}

Complex wave(double omega, double time) {
  return std::polar(1.0, -omega * time);
}

// The integral by Simpson's rule over the square root of time, in which the edge is smooth.
Complex transformOf(double exponent, double omega) {
  constexpr int kSteps = 40000;
  constexpr double kStep = 14.0 / kSteps;
  Complex sum = 0.0;
  for (int i = 0; i <= kSteps; ++i) {
    const double root = kStep * i;
    const double time = root * root;
    const double weight = i == 0 || i == kSteps ? 1.0 : (i % 2 == 1 ? 4.0 : 2.0);
    sum += weight * 2.0 * root * fadingEdge(exponent, time) * wave(omega, time);
  }
  return sum * kStep / 3.0;
}

Complex sumOf(double exponent, double phase, double omega) {
  Complex sum = 0.0;
  for (int point = 0; point < 200; ++point)
    sum += fadingEdge(exponent, phase + point) * wave(omega, phase + point);
  return sum;
}

Complex correctionOf(EdgeKind kind, double phase, double omega) {
  const EdgeCorrection correction = edgeCorrection(kind, phase);
  Complex sum = 0.0;
  double time = phase - static_cast<double>(EdgeCorrection::kBefore);
  for (const double value : correction.add) {
    sum += value * wave(omega, time);
    time += 1.0;
  }
  return sum;
}

// The correction removes all but one hundredth of the error that a sum over a raster makes at an
// edge, all over the band.
TEST(EdgeCorrection, MakesTheSumOverARasterTheIntegral) {
  for (const Edge& edge : kEdges) {
    double uncorrected = 0.0;
    double left = 0.0;
    for (int step = 0; step <= 8; ++step) {
      const double omega = 2.0 * std::numbers::pi * 0.5 * kBand * step / 8.0;
      const Complex wanted = transformOf(edge.exponent, omega);
      for (const double phase : {0.0, 0.21, 0.5, 0.777, 0.999}) {
        const Complex sum = sumOf(edge.exponent, phase, omega);
        uncorrected = std::max(uncorrected, std::abs(sum - wanted));
        const Complex corrected = sum + correctionOf(edge.kind, phase, omega);
        left = std::max(left, std::abs(corrected - wanted));
      }
    }
    EXPECT_LT(left, 0.01 * uncorrected) << edge.exponent;
  }
}

}  // namespace
}  // namespace carom
