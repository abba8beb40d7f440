#include "audio/contact/contact_noise.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace carom::audio {
namespace {

/// Root of the mean square of the force over the load, at which half of its power is left.
constexpr double kPulls = 1.5;

/// The third octaves, and three more above them, whose waves are heard below.
struct Frequencies {
  static constexpr std::size_t kCount = kThirdOctaves + 3;
  std::array<double, kCount> octaves{};  // binary logarithm of the frequency (Hz)
  std::array<double, kCount> squares{};  // (rad/s)^2

  static const Frequencies& all() {
    static const Frequencies frequencies;
    return frequencies;
  }

 private:
  Frequencies() {
    for (std::size_t band = 0; band < kCount; ++band) {
      const double frequency =
          thirdOctaves().front() * std::pow(10.0, 0.1 * static_cast<double>(band));
      const double omega = 2.0 * std::numbers::pi * frequency;
      octaves[band] = std::log2(frequency);
      squares[band] = omega * omega;
    }
  }
};

/// Adds the powers of the speed at which the bumps push, (m/s)^2.
void addBumps(const PassingBumps& bumps, double flatness, BandPowers& power) {
  if (bumps.texture == nullptr || !(bumps.speedOnTexture > 0.0)) return;
  const double climb = flatness * bumps.speed;
  const double octaves = std::log2(bumps.speedOnTexture);
  const Frequencies& frequencies = Frequencies::all();
  // Waves of a length that lie at an angle to the line are longer along it, and their slopes along
  // it smaller: the squares of its cosine, by third octaves below that of the waves that lie
  // across.
  constexpr double kSame = 0.7;
  constexpr double kNext = 0.18;
  constexpr double kThird = 0.06;
  constexpr double kFurther = 0.46;
  std::array<double, 3> above{};  // waves of the next band, those of the band after it, all further
  for (std::size_t band = Frequencies::kCount; band-- > 0;) {
    const double waves =
        climb * climb *
        bumps.texture->slopesAround(bumps.look, octaves - frequencies.octaves[band]);
    if (band < kThirdOctaves)
      power[band] += kSame * waves + kNext * above[0] + kThird * (above[1] + kFurther * above[2]);
    above[2] = above[1] + kFurther * above[2];
    above[1] = above[0];
    above[0] = waves;
  }
}

}  // namespace

void estimateForce(const BumpyContact& contact, BandPowers& force) {
  force.fill(0.0);
  for (const PassingBumps& bumps : contact.bumps)
    addBumps(bumps, contact.flatness, force);
  const double m = contact.mass;
  const double k = contact.stiffness;
  const double c = contact.damping;
  double power = 0.0;
  for (std::size_t band = 0; band < kThirdOctaves; ++band) {
    const double square = Frequencies::all().squares[band];
    const double held = k * k + square * c * c;
    const double swings = k - m * square;
    force[band] *= m * m * square * held / (swings * swings + square * c * c);
    power += force[band];
  }
  const double limit = kPulls * kPulls * contact.load * contact.load;
  const double left = limit > 0.0 ? limit / (limit + power) : 0.0;
  for (double& each : force)
    each *= left;
}

}  // namespace carom::audio
