#include "audio/scheduling/noise_propagation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>

#include <Eigen/Core>

#include "audio/dsp/spread_kernel.h"

namespace carom::audio {
namespace {

/// Angular frequencies (rad/s) of the third octaves, and their squares.
struct Angular {
  BandPowers omega{};
  BandPowers square{};
  static const Angular& all() {
    static const Angular angular = [] {
      Angular made;
      for (std::size_t band = 0; band < kThirdOctaves; ++band) {
        made.omega[band] = 2.0 * std::numbers::pi * thirdOctaves()[band];
        made.square[band] = made.omega[band] * made.omega[band];
      }
      return made;
    }();
    return angular;
  }
};

using Bands = Eigen::Array<double, kThirdOctaves, 1>;

Eigen::Map<const Bands> bandsOf(const double* values) {
  return Eigen::Map<const Bands>(values);
}

/// exp(-x) for x from 0 on: most third octaves lose next to nothing over a room's distances.
double left(double x) {
  constexpr double kLittle = 1e-3;
  return x < kLittle ? 1.0 - x + 0.5 * x * x : std::exp(-x);  // to 2e-10
}

/// Squares of what the walls of a path leave of each third octave.
BandPowers reflected(const std::vector<ReflectionFilter>& chain, double sampleRate) {
  BandPowers squares;
  squares.fill(1.0);
  for (std::size_t band = 0; band < kThirdOctaves; ++band) {
    const double turn = std::min(std::numbers::pi, Angular::all().omega[band] / sampleRate);
    for (const ReflectionFilter& wall : chain)
      squares[band] *= std::norm((wall.b0 + wall.b1 * std::polar(1.0, -turn)) /
                                 (1.0 + wall.a1 * std::polar(1.0, -turn)));
  }
  return squares;
}

}  // namespace

NoisePropagation::NoisePropagation(std::shared_ptr<const SoundPaths> paths,
                                   const ListenerTracks& tracks)
    : paths_(std::move(paths)), tracks_(tracks) {
  const double rate = paths_->settings.sampleRate;
  for (const auto& chain : paths_->chains) {
    walls_.push_back(reflected(chain, rate));
    for (std::size_t band = 0; band < kThirdOctaves; ++band)
      if (thirdOctaves()[band] > kBand * rate) walls_.back()[band] = 0.0;
  }
  if (paths_->air)
    for (std::size_t band = 0; band < kThirdOctaves; ++band)
      air_[band] = airAttenuation(paths_->settings.medium, thirdOctaves()[band]);
  const std::size_t channels = paths_->channels.size() + (paths_->settings.reverb ? 1 : 0);
  powers_.resize(channels * kThirdOctaves);
}

void NoisePropagation::propagate(double time, std::span<const Strike> strikes,
                                 const BandPowers& force) {
  force_ = &force;
  place(time);
  std::ranges::fill(powers_, 0.0);
  delay_ = 0.0;
  const std::size_t count = std::min<std::size_t>(strikes.size(), 2);
  const std::span<double> all(powers_);
  std::array<Ray, 2> rays;
  for (std::size_t channel = 0; channel < paths_->channels.size(); ++channel) {
    for (const SoundPaths::Path& path : paths_->paths) {
      for (std::size_t i = 0; i < count; ++i)
        rays[i] = rayOf(strikes[i], channel, path.image);
      if (path.image == nullptr && count > 0) delay_ += rays[0].delay;
      add(std::span(rays).first(count), withAir(walls_[path.chain], rays[0].air),
          all.subspan(channel * kThirdOctaves, kThirdOctaves));
    }
  }
  delay_ /= static_cast<double>(paths_->channels.size());
  rate();
  if (!paths_->settings.reverb) return;
  for (std::size_t i = 0; i < count; ++i)
    rays[i] = sendOf(strikes[i]);
  add(std::span(rays).first(count), walls_.front(), all.last(kThirdOctaves));
}

double NoisePropagation::boundOverHearing(double time, std::span<const Strike> strikes,
                                          const BandPowers& force) {
  place(time);
  BandPowers powers{};
  for (const Strike& strike : strikes) {
    // All paths to all channels together, without what walls and the air take.
    double far = 0.0;
    double near = 0.0;
    double corner = 0.0;
    for (std::size_t channel = 0; channel < paths_->channels.size(); ++channel) {
      for (const SoundPaths::Path& path : paths_->paths) {
        const Ray ray = rayOf(strike, channel, path.image);
        far += ray.gain * ray.gain;
        near += ray.gain * ray.gain * ray.near * ray.near;
        corner = std::max(corner, ray.corner);
      }
    }
    const double size = 0.25 / (corner * corner * corner * corner);
    const BandPowers& squares = Angular::all().square;
    for (std::size_t band = 0; band < kThirdOctaves; ++band)
      powers[band] += (far * squares[band] + near) / (1.0 + size * squares[band] * squares[band]);
  }
  // The pressures of two bodies add up to twice the sum of their powers, at most.
  const auto most = static_cast<double>(strikes.size());
  double over = 0.0;
  for (std::size_t band = 0; band < kThirdOctaves; ++band)
    over = std::max(over, most * force[band] * powers[band] / hearingThreshold()[band]);
  return over;
}

/// Finds all channels' receivers, once for all contacts of a moment.
void NoisePropagation::place(double time) {
  if (!places_.empty() && time == placedAt_ && tracks_.changes() == placedAfter_) return;
  placedAt_ = time;
  placedAfter_ = tracks_.changes();
  places_.clear();
  for (const SoundPaths::Channel& channel : paths_->channels)
    places_.push_back(tracks_.placeOf(channel, time));
}

NoisePropagation::Ray NoisePropagation::rayOf(const Strike& strike, std::size_t channel,
                                              const Image* image) const {
  const double speed = paths_->settings.medium.speedOfSound;
  const Vec3 from = image != nullptr ? image->position(strike.position) : strike.position;
  const Vec3 dipole = image != nullptr ? image->vector(strike.dipole) : strike.dipole;
  const auto& [ear, orientation] = places_[channel];
  if (image != nullptr && !isVisible(paths_->settings.room, *image, strike.position, ear))
    return {};
  const Vec3 way = from - ear;
  const double length = way.norm();
  const Vec3 towards = length > 0.0 ? Vec3(way / length) : Vec3::Zero();
  const double distance = std::max(length, strike.radius);
  const double ahead = std::min(strike.radius, kLargestFilteredRadius);
  Ray ray{.gain = -dipole.dot(towards) / distance,
          .near = speed / distance,
          .corner = speed / ahead,
          .delay = (distance - ahead) / speed,
          .air = paths_->air ? paths_->air->heardDistance(distance) : 0.0};
  const SoundPaths::Channel& heard = paths_->channels[channel];
  if (!heard.isEar && heard.receiver.pattern != 0.0)
    ray.gain *= gain(heard.receiver, orientation, towards);
  return ray;
}

/// Returns what is sent into the reverberation, as ContactPropagation does.
NoisePropagation::Ray NoisePropagation::sendOf(const Strike& strike) const {
  return {.gain = strike.dipole.norm() / std::numbers::sqrt3,
          .corner = paths_->settings.medium.speedOfSound /
                    std::min(strike.radius, kLargestFilteredRadius)};
}

/// Returns what walls and the air leave of each third octave over a path.
BandPowers NoisePropagation::withAir(BandPowers walls, double distance) const {
  if (distance != 0.0)
    for (std::size_t band = 0; band < kThirdOctaves; ++band)
      walls[band] *= left(distance * air_[band]);
  return walls;
}

void NoisePropagation::add(std::span<const Ray> rays, std::span<const double> walls,
                           std::span<double> powers) const {
  const auto square = bandsOf(Angular::all().square.data());
  const Bands force = bandsOf(force_->data()) * bandsOf(walls.data());
  for (const Ray& ray : rays) {
    const double gain = ray.gain * ray.gain;
    if (gain == 0.0) continue;
    const double near = ray.near * ray.near;
    const double size = 0.25 / (ray.corner * ray.corner * ray.corner * ray.corner);
    Eigen::Map<Bands>(powers.data()) +=
        force * (gain * (square + near)) / (1.0 + size * square * square);
  }
  if (rays.size() == 2 && rays[0].gain != 0.0 && rays[1].gain != 0.0)
    addTogether(rays[0], rays[1], walls, powers);
}

/// Adds what two rays of one force have in common: twice the real part of the product of one
/// response, gain (near + i w) / D with D = 1 + i w/corner - (w/corner)^2 / 2, and the conjugate of
/// the other.
void NoisePropagation::addTogether(const Ray& one, const Ray& other, std::span<const double> walls,
                                   std::span<double> powers) const {
  const auto omega = bandsOf(Angular::all().omega.data());
  const auto square = bandsOf(Angular::all().square.data());
  // Within a third octave the phase between the two turns by `turn` to either side.
  const Bands phase = (one.delay - other.delay) * omega;
  const Bands turn = 0.5 * kThirdOctaveWidth * phase;
  const auto count = (turn.abs() <= std::numbers::pi).count();  // of the lowest
  if (count == 0) return;
  // Sines and cosines are to a float's precision: several at once.
  const Bands turns = phase / (2.0 * std::numbers::pi);
  const auto angle = (2.0 * std::numbers::pi * (turns - turns.round())).cast<float>().eval();
  const Bands alike = (turn == 0.0).select(1.0, turn.cast<float>().sin().cast<double>() / turn);
  // Products of the numerators, and of the denominators' conjugates, as real and imaginary part.
  const Bands nears = one.near * other.near + square;
  const Bands nearsAcross = omega * (other.near - one.near);
  const Bands u = omega / one.corner;
  const Bands v = omega / other.corner;
  const Bands real = 1.0 - 0.5 * u * u;
  const Bands otherReal = 1.0 - 0.5 * v * v;
  const Bands sizes = real * otherReal + u * v;
  const Bands sizesAcross = real * v - u * otherReal;
  const Bands both = (nears * sizes - nearsAcross * sizesAcross) * angle.cos().cast<double>() +
                     (nears * sizesAcross + nearsAcross * sizes) * angle.sin().cast<double>();
  const Bands damped = (real * real + u * u) * (otherReal * otherReal + v * v);
  const Bands common = 2.0 * one.gain * other.gain * alike * both / damped *
                       bandsOf(force_->data()) * bandsOf(walls.data());
  Eigen::Map<Bands>(powers.data()).head(count) += common.head(count);
}

void NoisePropagation::rate() {
  power_ = overHearing_ = loudness_ = 0.0;
  for (std::size_t channel = 0; channel < paths_->channels.size(); ++channel) {
    double loudness = 0.0;
    for (std::size_t band = 0; band < kThirdOctaves; ++band) {
      double& power = powers_[channel * kThirdOctaves + band];
      power = std::max(power, 0.0);
      power_ += power;
      const double over = power / hearingThreshold()[band];
      loudness += over;
      overHearing_ = std::max(overHearing_, over);
    }
    loudness_ = std::max(loudness_, loudness);
  }
}

}  // namespace carom::audio
