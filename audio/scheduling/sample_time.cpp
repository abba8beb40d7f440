#include "audio/scheduling/sample_time.h"

#include <cmath>

namespace carom::audio {
namespace {

/// Rounding error a b - product of a product (Dekker 1971): exact below 1e290.
double roundingOf(double a, double b, double product) {
  constexpr double kSplit = 0x1.0p+27 + 1.0;
  const double a1 = kSplit * a - (kSplit * a - a);
  const double b1 = kSplit * b - (kSplit * b - b);
  const double a2 = a - a1;
  const double b2 = b - b1;
  return ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2;
}

}  // namespace

SampleTime samplesOf(double seconds, double further, double sampleRate) {
  const double product = seconds * sampleRate;
  const double rounding = roundingOf(seconds, sampleRate, product);
  const double floor = std::floor(product);
  const double rest = (product - floor) + rounding + further * sampleRate;
  const double carry = std::floor(rest);
  return {static_cast<std::int64_t>(floor) + static_cast<std::int64_t>(carry), rest - carry};
}

SampleTime shifted(SampleTime time, const SampleShift& shift) {
  time.whole += shift.whole;
  time.fraction += shift.fraction;
  if (time.fraction >= 1.0) {
    time.fraction -= 1.0;
    ++time.whole;
  }
  return time;
}

}  // namespace carom::audio
