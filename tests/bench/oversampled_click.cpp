#include "tests/bench/oversampled_click.h"

#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <vector>

#include "carom/audio/material.h"

namespace carom::bench {

using namespace audio;

namespace {

using test::ClickCase;

constexpr double kTimes = 64.0;
constexpr double kPlace = 0.87;  // samples, from the first one to the beginning of the force

/// The click in 1/s^2 at 64 times the rate, for a change of speed of 1 m/s.
class FineClick {
 public:
  explicit FineClick(const ClickCase& click)
      : pulse_(test::pulseOf(click)),
        duration_(click.duration),
        step_(1.0 / (kTimes * click.sampleRate)),
        begin_(pulse_.begin() * duration_ - kPlace * step_),
        radiusTime_(click.radius / Medium().speedOfSound),
        nearRate_(Medium().speedOfSound / click.distance),
        isCompact_(click.radiation == Radiation::compact) {}

  double begin() const { return begin_; }
  double step() const { return step_; }

  std::vector<double> samples() const {
    const double ringing = isCompact_ ? 0.0 : 40.0 * radiusTime_;
    const double lasting = (pulse_.end() - pulse_.begin()) * duration_ + ringing;
    const auto count = static_cast<std::size_t>(lasting / step_) + 3;
    std::vector<double> samples(count);
    State state;
    for (std::size_t sample = 0; sample < count; ++sample) {
      const double time = begin_ + static_cast<double>(sample) * step_;
      samples[sample] = isCompact_ ? meanSlope(time) : state.rate + nearRate_ * state.value;
      if (!isCompact_) state = next(state, time);
    }
    return samples;
  }

 private:
  struct State {
    double value = 0.0;
    double rate = 0.0;
  };

  /// Mean slope of the force over one step.
  double meanSlope(double time) const {
    const double half = 0.5 * step_;
    const double rise =
        pulse_.force((time + half) / duration_) - pulse_.force((time - half) / duration_);
    return rise / (duration_ * step_);
  }

  State changeOf(const State& state, double time) const {
    const double force = pulse_.force(time / duration_) / duration_;
    const double inertia = 0.5 * radiusTime_ * radiusTime_;
    return {state.rate, (force - state.value - radiusTime_ * state.rate) / inertia};
  }

  State next(const State& state, double time) const {
    const auto moved = [&](const State& change, double by) {
      return State{state.value + by * change.value, state.rate + by * change.rate};
    };
    const double half = 0.5 * step_;
    const State first = changeOf(state, time);
    const State second = changeOf(moved(first, half), time + half);
    const State third = changeOf(moved(second, half), time + half);
    const State fourth = changeOf(moved(third, step_), time + step_);
    return {
        state.value +
            step_ / 6.0 * (first.value + 2.0 * (second.value + third.value) + fourth.value),
        state.rate + step_ / 6.0 * (first.rate + 2.0 * (second.rate + third.rate) + fourth.rate)};
  }

  Pulse pulse_;
  double duration_;
  double step_;
  double begin_;  // s, time of the first sample
  double radiusTime_;
  double nearRate_;
  bool isCompact_;
};

/// Factor from 1/s^2 to Pa.
double loudness(const ClickCase& click) {
  const Medium air;
  return air.density * std::pow(click.radius, 3) / (2.0 * air.speedOfSound * click.distance) *
         test::speedChange(click);
}

/// Factor by which a mean over `step` attenuates a sine.
double meanOver(double step, double frequency) {
  const double angle = std::numbers::pi * frequency * step;
  return std::sin(angle) / angle;
}

}  // namespace

double oversampledDifference(const ClickCase& click) {
  ClickCase undelayed = click;
  const double ahead = click.radiation == Radiation::compact ? 0.0 : click.radius;
  undelayed.time = -(click.distance - ahead) / Medium().speedOfSound;
  const std::vector<double> frequencies = test::bandFrequencies(click);
  const auto exact = test::exactSpectrum(undelayed, frequencies);
  const FineClick fine(click);
  auto difference = test::spectrumOf(fine.samples(), 1.0 / fine.step(), frequencies);
  for (std::size_t i = 0; i < difference.size(); ++i) {
    const double turn = -2.0 * std::numbers::pi * frequencies[i] * fine.begin();
    const double dimmed =
        click.radiation == Radiation::compact ? meanOver(fine.step(), frequencies[i]) : 1.0;
    difference[i] *= std::polar(loudness(click) / dimmed, turn);
    difference[i] -= exact[i];
  }
  return 10.0 *
         std::log10(test::energyOf(difference, frequencies) / test::energyOf(exact, frequencies));
}

}  // namespace carom::bench
