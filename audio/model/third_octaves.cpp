#include "audio/model/third_octaves.h"

#include <cmath>

namespace carom::audio {
namespace {

/// Exponent of the lowest centre: 10^1.7 Hz.
constexpr int kLowest = 17;
/// Pa: 0 dB.
constexpr double kReference = 20e-6;
/// dB, 50 Hz to 16 kHz.
constexpr BandPowers kThresholdLevels = {44.0, 37.5, 31.5, 26.5, 22.1, 17.9, 14.4, 11.4, 8.6,
                                         6.2,  4.4,  3.0,  2.2,  2.4,  3.5,  1.7,  -1.3, -4.2,
                                         -6.0, -5.4, -1.5, 6.0,  12.6, 13.9, 12.3, 40.2};

}  // namespace

const std::array<double, kThirdOctaves>& thirdOctaves() {
  static const auto centres = [] {
    std::array<double, kThirdOctaves> all{};
    for (std::size_t band = 0; band < kThirdOctaves; ++band)
      all[band] = std::pow(10.0, 0.1 * static_cast<double>(kLowest + static_cast<int>(band)));
    return all;
  }();
  return centres;
}

const BandPowers& hearingThreshold() {
  static const BandPowers powers = [] {
    BandPowers all{};
    for (std::size_t band = 0; band < kThirdOctaves; ++band)
      all[band] = kReference * kReference * std::pow(10.0, 0.1 * kThresholdLevels[band]);
    return all;
  }();
  return powers;
}

}  // namespace carom::audio
