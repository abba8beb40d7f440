#include "tests/support/hertz_contact.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace carom::test {
namespace {

double compliance(const Material& material) {
  return (1.0 - material.poissonsRatio * material.poissonsRatio) / material.youngsModulus;
}

}  // namespace

double BallStrike::ballMass() const {
  return 4.0 / 3.0 * std::numbers::pi * std::pow(ballRadius, 3.0) * ball.density;
}

double BallStrike::effectiveMass() const {
  return bodyMass > 0.0 ? 1.0 / (1.0 / ballMass() + 1.0 / bodyMass) : ballMass();
}

ImpulseEvent BallStrike::event() const {
  ImpulseEvent event;
  event.time = time;
  event.body = 2;
  event.other = 1;
  event.normal = inward;
  event.impulse = impulse() * inward;
  event.position = at;
  event.approachSpeed = speed;
  event.effectiveMass = effectiveMass();
  event.otherRadius = ballRadius;
  if (bodyCurvature > 0.0) event.radius = 1.0 / bodyCurvature;
  return event;
}

// Integrates in units of V T and T = (m^2 / (k^2 V))^(1/5), with k the stiffness and V the speed:
// d'' = -d^(3/2), d'(0) = 1.
HertzContact::HertzContact(const BallStrike& strike) {
  constexpr double kStep = 1e-3;
  const auto pull = [](double d) { return d > 0.0 ? -d * std::sqrt(d) : 0.0; };
  const double mass = strike.effectiveMass();
  const double modulus = 1.0 / (compliance(strike.ball) + compliance(strike.body));
  const double stiffness =
      4.0 / 3.0 * modulus / std::sqrt(1.0 / strike.ballRadius + strike.bodyCurvature);
  const double unit = std::pow(mass * mass / (stiffness * stiffness * strike.speed), 0.2);
  const double scale = mass * strike.speed / unit;
  step_ = kStep * unit;
  double d = 0.0;
  double v = 1.0;
  do {
    force_.push_back(-scale * pull(d));
    const double a1 = pull(d);
    const double a2 = pull(d + 0.5 * kStep * v);
    const double a3 = pull(d + 0.5 * kStep * (v + 0.5 * kStep * a1));
    const double a4 = pull(d + kStep * (v + 0.5 * kStep * a2));
    d += kStep * v + kStep * kStep / 6.0 * (a1 + a2 + a3);
    v += kStep / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
  } while (d > 0.0);
  force_.push_back(0.0);
}

double HertzContact::force(double t) const {
  const double place = t / step_;
  if (!(place > 0.0 && place < static_cast<double>(force_.size() - 1))) return 0.0;
  const auto index = static_cast<std::size_t>(place);
  return std::lerp(force_[index], force_[index + 1], place - static_cast<double>(index));
}

std::complex<double> HertzContact::transform(std::complex<double> s) const {
  std::complex<double> sum = 0.0;
  for (std::size_t index = 0; index < force_.size(); ++index)
    sum += force_[index] * std::exp(s * (step_ * static_cast<double>(index)));
  return step_ * sum;
}

}  // namespace carom::test
