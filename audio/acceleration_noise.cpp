#include "audio/acceleration_noise.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace carom {
namespace {

constexpr double kExponent = 6.0;  // of eq. 9

double slopeAround(double fromCentre) {
  return -2.0 * kExponent * fromCentre * std::exp(-kExponent * fromCentre * fromCentre);
}

/// A time in samples, without loss: the product's rounding error is recovered and kept.
struct SampleTime {
  std::int64_t whole = 0;
  double fraction = 0.0;
};

SampleTime samplesOf(double seconds, double further, double sampleRate) {
  const double product = seconds * sampleRate;
  const double rounding = std::fma(seconds, sampleRate, -product);
  const double floor = std::floor(product);
  const double rest = (product - floor) + rounding + further * sampleRate;
  const double carry = std::floor(rest);
  return {static_cast<std::int64_t>(floor) + static_cast<std::int64_t>(carry), rest - carry};
}

}  // namespace

double gaussianPulse(double u) {
  return std::exp(-kExponent * (u - 0.5) * (u - 0.5));
}

double gaussianPulseSlope(double u) {
  return slopeAround(u - 0.5);
}

double compactRadiation(const Medium& medium, double bodyRadius, double distance, double cosine) {
  const double r = std::max(distance, bodyRadius);
  return medium.density * bodyRadius * bodyRadius * bodyRadius * cosine /
         (2.0 * medium.speedOfSound * r);
}

double Click::peak() const {
  return std::abs(amplitude) * kPulsePeakSlope;
}

double Click::pressure(double t) const {
  return amplitude * gaussianPulseSlope((t - time - delay) / duration);
}

Click makeClick(const ImpulseEvent& event, const SoundBody& body, double duration,
                const Vec3& listener, const Medium& medium) {
  const Vec3 towards = listener - event.bodyPosition;
  const double distance = towards.norm();
  const double impulse = event.impulse.norm();
  const double scale = impulse * distance;
  // At the very centre of the body, or without an impulse, there is no direction: a dipole's mean.
  const double cosine = scale > 0.0 ? event.impulse.dot(towards) / scale : 0.0;
  const double acceleration = std::numbers::pi * impulse / (2.0 * body.mass * duration);
  const double radiation = compactRadiation(medium, body.radius, distance, cosine);
  const double delay = std::max(distance, body.radius) / medium.speedOfSound;
  return {event.time, delay, duration, radiation * acceleration / duration};
}

bool canSample(const Click& click, double sampleRate) {
  const double extent = std::abs(click.time) + click.delay + 2.0 * kPulseHalfWidth * click.duration;
  return extent * sampleRate < kExactSamples;  // false for NaN too
}

SampledClick sampleClick(const Click& click, double sampleRate, std::uint32_t channel) {
  assert(canSample(click, sampleRate));
  const SampleTime centre = samplesOf(click.time, click.delay + 0.5 * click.duration, sampleRate);
  const double duration = click.duration * sampleRate;
  const double reach = kPulseHalfWidth * duration;
  const auto first = static_cast<std::int64_t>(std::ceil(centre.fraction - reach));
  const auto last = static_cast<std::int64_t>(std::floor(centre.fraction + reach));
  return {.first = centre.whole + first,
          .end = centre.whole + last + 1,
          .centre = centre.whole,
          .fraction = centre.fraction,
          .duration = duration,
          .amplitude = click.amplitude,
          .channel = channel};
}

void addClick(const SampledClick& click, std::int64_t position,
              std::span<double> pressure) noexcept {
  const std::int64_t begin = std::max(click.first, position);
  const std::int64_t end = std::min(click.end, position + std::ssize(pressure));
  for (std::int64_t sample = begin; sample < end; ++sample) {
    const double fromCentre = static_cast<double>(sample - click.centre) - click.fraction;
    pressure[static_cast<std::size_t>(sample - position)] +=
        click.amplitude * slopeAround(fromCentre / click.duration);
  }
}

}  // namespace carom
