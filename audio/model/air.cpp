#include "audio/model/air.h"

#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "carom/audio/absorption.h"

namespace carom {
namespace audio {
namespace {

// The reference values of ISO 9613-1:1993, 4.2 and annex B.
constexpr double kReferencePressure = 101325.0;   // Pa
constexpr double kReferenceTemperature = 293.15;  // K
constexpr double kTriplePoint = 273.16;           // K, of water

/// Air as the standard's equations need it.
struct MoistAir {
  explicit MoistAir(const Medium& medium)
      : pressure(medium.pressure / kReferencePressure),
        warmth(medium.temperature / kReferenceTemperature) {
    // Equations (B.1) to (B.3): the share of water in the molecules, in per cent.
    const double exponent = -6.8346 * std::pow(kTriplePoint / medium.temperature, 1.261) + 4.6151;
    const double water = 100.0 * medium.humidity * std::pow(10.0, exponent) / pressure;
    // Equations (3) and (4).
    oxygen = pressure * (24.0 + 4.04e4 * water * (0.02 + water) / (0.391 + water));
    nitrogen = pressure / std::sqrt(warmth) *
               (9.0 + 280.0 * water * std::exp(-4.170 * (1.0 / std::cbrt(warmth) - 1.0)));
  }

  double pressure;  // over that of reference
  double warmth;    // temperature over that of reference
  double oxygen;    // Hz, relaxation frequency
  double nitrogen;  // Hz
};

Status refuseAir(const std::string& what, double value, const std::string& accepted) {
  return Error{what + " of the air is " + std::to_string(value) + ", must be " + accepted};
}

bool isFromTo(double value, double low, double high) {
  return value >= low && value <= high;
}

}  // namespace

Status validateAir(const Medium& medium) {
  if (!isFromTo(medium.temperature, 200.0, 350.0))
    return refuseAir("temperature", medium.temperature, "200 to 350 K (20 degrees C: 293.15)");
  if (!isFromTo(medium.humidity, 0.0, 1.0))
    return refuseAir("relative humidity", medium.humidity, "0 to 1 (50 %: 0.5)");
  if (!isFromTo(medium.pressure, 1e3, 2e5))
    return refuseAir("pressure", medium.pressure, "1000 to 200000 Pa");
  return std::monostate{};
}

}  // namespace audio

double airAttenuation(const Medium& medium, double frequency) {
  const audio::MoistAir air(medium);
  const double square = frequency * frequency;
  const auto relaxed = [&](double strength, double warmth, double relaxation) {
    return strength * std::exp(-warmth / medium.temperature) / (relaxation + square / relaxation);
  };
  // Equation (5), in nepers of pressure in place of its decibels, 8.686 to the neper.
  const double classical = 1.84e-11 / air.pressure * std::sqrt(air.warmth);
  const double relaxing = std::pow(air.warmth, -2.5) * (relaxed(0.01275, 2239.1, air.oxygen) +
                                                        relaxed(0.1068, 3352.0, air.nitrogen));
  return 2.0 * square * (classical + relaxing);
}

std::array<double, kBandCount> airAttenuation(const Medium& medium) {
  std::array<double, kBandCount> attenuation{};
  for (std::size_t band = 0; band < kBandCount; ++band)
    attenuation[band] = airAttenuation(medium, kOctaveBands[band]);
  return attenuation;
}

}  // namespace carom
