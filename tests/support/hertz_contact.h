#pragma once

#include <complex>
#include <vector>

#include "carom/audio/impulse_event.h"
#include "carom/audio/material.h"

namespace carom::test {

/// A small ball that meets a body: what both an event and the contact below are made from.
struct BallStrike {
  Material ball = {};
  Material body = {};
  double ballRadius = 0.01;     ///< m
  double speed = 0.1;           ///< m/s, of approach
  double bodyMass = 0.0;        ///< kg, as felt where it is hit; 0: infinite
  double bodyCurvature = 0.0;   ///< 1/m, mean of the principal ones
  Vec3 at = Vec3::Zero();       ///< m, world frame
  Vec3 inward = Vec3::UnitX();  ///< unit: the ball's way, along which it pushes the body
  double time = 0.0;            ///< s, of first touch

  double ballMass() const;
  double effectiveMass() const;
  double impulse() const { return 2.0 * effectiveMass() * speed; }  ///< N s, elastic
  /// The body's share; `ball` and `body` are the ids 1 and 2.
  ImpulseEvent event() const;
};

/// The force between the two, by integration of m d'' = -4/3 E* sqrt(R) d^(3/2) from the formulas
/// of Johnson 1985 (sections 4.2 and 11.4): nothing of the library's pulses is in it.
class HertzContact {
 public:
  explicit HertzContact(const BallStrike& strike);

  double duration() const { return step_ * static_cast<double>(force_.size() - 1); }  ///< s
  /// N, t in s after first touch.
  double force(double t) const;
  /// N s, the integral of the force times exp(s t), s in 1/s.
  std::complex<double> transform(std::complex<double> s) const;

 private:
  double step_ = 0.0;
  std::vector<double> force_;
};

}  // namespace carom::test
