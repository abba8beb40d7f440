#include "audio/contact/contact_noise.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace carom::audio {
namespace {

/// Root of the mean square of the force over the load, at which half of its power is left.
constexpr double kPulls = 1.5;
/// Power that ContactDrive gives over that of the estimate, measured with built-in materials at
/// 0.05 to 1 m/s: -0.7 dB.
constexpr double kMeasured = 0.85;

/// Squares of the angular frequencies of the third octaves, (rad/s)^2.
const BandPowers& angularSquares() {
  static const BandPowers squares = [] {
    BandPowers all{};
    for (std::size_t band = 0; band < kThirdOctaves; ++band) {
      const double omega = 2.0 * std::numbers::pi * thirdOctaves()[band];
      all[band] = omega * omega;
    }
    return all;
  }();
  return squares;
}

}  // namespace

void estimateForce(const BumpyContact& contact, BandPowers& force) {
  force.fill(0.0);
  // First the powers of the speed at which the bumps push, (m/s)^2.
  for (const PassingBumps& bumps : contact.bumps) {
    if (bumps.texture == nullptr || !(bumps.speedOnTexture > 0.0)) continue;
    const double climb = contact.flatness * bumps.speed;
    bumps.texture->addSlopes(bumps.look, bumps.speedOnTexture / thirdOctaves().front(),
                             climb * climb, force);
  }
  const double m = contact.mass;
  const double k = contact.stiffness;
  const double c = contact.damping;
  double power = 0.0;
  for (std::size_t band = 0; band < kThirdOctaves; ++band) {
    const double square = angularSquares()[band];
    const double held = k * k + square * c * c;
    const double swings = k - m * square;
    force[band] *= m * m * square * held / (swings * swings + square * c * c);
    power += force[band];
  }
  const double limit = kPulls * kPulls * contact.load * contact.load;
  const double left = limit > 0.0 ? kMeasured * limit / (limit + power) : 0.0;
  for (double& each : force)
    each *= left;
}

}  // namespace carom::audio
