#include "tests/support/noisy_slides.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdlib>
#include <numbers>

#include "carom/audio/material.h"

namespace carom::test {
namespace {

constexpr double kGravity = 9.81;
constexpr double kFriction = 0.4;

/// An own transform, in place, of a power of two.
void transform(std::vector<std::complex<double>>& values) {
  const std::size_t size = values.size();
  for (std::size_t i = 1, j = 0; i < size; ++i) {
    std::size_t bit = size / 2;
    for (; (j & bit) != 0; bit /= 2)
      j ^= bit;
    j ^= bit;
    if (i < j) std::swap(values[i], values[j]);
  }
  for (std::size_t length = 2; length <= size; length *= 2) {
    for (std::size_t k = 0; k < length / 2; ++k) {
      const auto turn = std::polar(
          1.0, -2.0 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(length));
      for (std::size_t i = k; i < size; i += length) {
        const auto odd = values[i + length / 2] * turn;
        values[i + length / 2] = values[i] - odd;
        values[i] += odd;
      }
    }
  }
}

}  // namespace

Synth NoisySlides::synth(const SynthSettings& settings) const {
  SynthSettings wanted = settings;
  wanted.sampleRate = kRate;
  Listener ear{"ear", Vec3(0.0, -distance, 1.0)};
  ear.format = ListenerFormat::spacedPair;
  ear.spacing = 0.2;
  Synth made = *Synth::create(wanted, {ear});
  const Material stuff = *findMaterial(material);
  const double mass = stuff.density * side * side * side;
  const double radius = std::cbrt(3.0 / (4.0 * std::numbers::pi)) * side;
  bool isSet = static_cast<bool>(made.setBody(0, {.material = stuff}));
  for (std::size_t body = 1; body <= count; ++body)
    isSet = isSet && made.setBody(static_cast<BodyId>(body),
                                  {.material = stuff, .mass = mass, .radius = radius});
  if (!isSet) std::abort();
  return made;
}

ContactState NoisySlides::state(std::size_t body, std::size_t index) const {
  const auto wayAt = [&](double time) {
    const double spread = count > 1 ? static_cast<double>(body) / static_cast<double>(count) : 0.0;
    const double first = speed * (1.0 - 0.3 * spread);
    const double t = slowing > 0.0 ? std::min(time, first / slowing) : time;
    return first * t - 0.5 * slowing * t * t;
  };
  const Material stuff = *findMaterial(material);
  ContactState made;
  made.time = static_cast<double>(index) * step;
  made.duration = step;
  made.phase = index == 0 ? ContactPhase::begin : ContactPhase::during;
  made.body = static_cast<BodyId>(body + 1);
  made.other = 0;
  made.normal = Vec3::UnitZ();
  const double turn = 0.3 + 0.7 * static_cast<double>(body);
  const Vec3 along(std::cos(turn), std::sin(turn), 0.0);
  const Vec3 lane(0.0, 0.37 * static_cast<double>(body), 0.0);
  const double from = wayAt(made.time);
  const double to = wayAt(made.time + step);
  const double now = (to - from) / step;
  const double radius = std::cbrt(3.0 / (4.0 * std::numbers::pi)) * side;
  // Only the paths move: all stay as near to the listener as they are.
  made.position = lane;
  made.normalLoad = stuff.density * side * side * side * kGravity;
  if (body == 0 && pressed != nullptr) made.normalLoad *= pressed(made.time);
  const double friction = rolls ? 0.0 : kFriction;
  made.appliedImpulse =
      made.normalLoad * step * (Vec3::UnitZ() - (now > 0.0 ? friction : 0.0) * along);
  made.slipVelocity = rolls ? Vec3(Vec3::Zero()) : Vec3(now * along);
  made.bodyPosition = made.position + (rolls ? radius : 0.5 * side) * Vec3::UnitZ();
  made.otherPathStart = lane + from * along;
  made.otherPathEnd = lane + to * along;
  made.pathStart = made.pathEnd = -0.5 * side * Vec3::UnitZ();
  if (rolls) {
    made.radius = radius;
    made.bodyOrientation =
        Eigen::AngleAxisd(from / radius, Vec3::UnitZ().cross(along).normalized());
    const Quat after(Eigen::AngleAxisd(to / radius, Vec3::UnitZ().cross(along).normalized()));
    made.pathStart = made.bodyOrientation.conjugate() * Vec3(0.0, 0.0, -radius);
    made.pathEnd = after.conjugate() * Vec3(0.0, 0.0, -radius);
  } else {
    made.radius = 0.0;
  }
  return made;
}

std::vector<std::vector<double>> NoisySlides::sound(const SynthSettings& settings,
                                                    SynthCounters* counters) const {
  Synth made = synth(settings);
  const auto steps = static_cast<std::size_t>(duration / step);
  std::vector<std::vector<double>> all(made.channelCount());
  std::vector<std::vector<double>> block(made.channelCount());
  for (std::size_t index = 0; index < steps; ++index) {
    for (std::size_t body = 0; body < count; ++body)
      made.updateContact(state(body, index));
    // A step behind, as a host with a latency.
    const double until = static_cast<double>(index) * step;
    const auto frames = static_cast<std::size_t>(std::max(0.0, (until - made.time()) * kRate));
    std::vector<double*> channels;
    for (auto& channel : block) {
      channel.resize(frames);
      channels.push_back(channel.data());
    }
    made.render<double>(channels, frames);
    for (std::size_t channel = 0; channel < all.size(); ++channel)
      all[channel].insert(all[channel].end(), block[channel].begin(), block[channel].end());
  }
  if (counters != nullptr) *counters = made.counters();
  return all;
}

std::vector<double> thirdOctavesOf(const std::vector<double>& sound, std::size_t begin,
                                   std::size_t end) {
  constexpr std::size_t kSize = 8192;
  std::vector<double> powers(26, 0.0);
  std::size_t windows = 0;
  for (std::size_t at = begin; at + kSize <= end; at += kSize / 2) {
    std::vector<std::complex<double>> values(kSize);
    double weight = 0.0;
    for (std::size_t i = 0; i < kSize; ++i) {
      const double turn = 2.0 * std::numbers::pi * static_cast<double>(i) / kSize;
      // Blackman and Harris: side lobes at -92 dB.
      const double window = 0.35875 - 0.48829 * std::cos(turn) + 0.14128 * std::cos(2.0 * turn) -
                            0.01168 * std::cos(3.0 * turn);
      values[i] = window * sound[at + i];
      weight += window * window;
    }
    transform(values);
    ++windows;
    for (std::size_t line = 1; line < kSize / 2; ++line) {
      const double frequency = static_cast<double>(line) * NoisySlides::kRate / kSize;
      const long band = std::lround(10.0 * std::log10(frequency)) - 17;
      if (band >= 0 && band < 26)
        powers[static_cast<std::size_t>(band)] += 2.0 * std::norm(values[line]) / (weight * kSize);
    }
  }
  for (double& power : powers)
    power /= static_cast<double>(std::max<std::size_t>(windows, 1));
  return powers;
}

}  // namespace carom::test
