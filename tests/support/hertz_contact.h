#pragma once

#include <complex>
#include <vector>

#include "carom/audio/impulse_event.h"
#include "carom/audio/material.h"

namespace carom::test {

/// A small ball that hits a body: the source of both an event and the contact force below.
struct BallStrike {
  Material ball = {};
  Material body = {};
  double ballRadius = 0.01;     ///< m
  double speed = 0.1;           ///< m/s, of approach
  double bodyMass = 0.0;        ///< kg, effective mass where the body is hit; 0: infinite
  double bodyCurvature = 0.0;   ///< 1/m, mean of the principal curvatures
  Vec3 at = Vec3::Zero();       ///< m, world frame
  Vec3 inward = Vec3::UnitX();  ///< unit: direction in which the ball moves and pushes
  double time = 0.0;            ///< s, of first touch

  double ballMass() const;
  double effectiveMass() const;
  double impulse() const { return 2.0 * effectiveMass() * speed; }  ///< N s, elastic
  /// The body's share of the collision; `ball` has the id 1, `body` the id 2.
  ImpulseEvent event() const;
};

/// The force between ball and body, by integration of m d'' = -4/3 E* sqrt(R) d^(3/2) from the
/// formulas of Johnson 1985 (sections 4.2 and 11.4): independent of the library's pulses.
class HertzContact {
 public:
  explicit HertzContact(const BallStrike& strike);

  double duration() const { return step_ * static_cast<double>(force_.size() - 1); }  ///< s
  /// Force in N, at t in s after first touch.
  double force(double t) const;
  /// The integral of the force times exp(s t) in N s, s in 1/s.
  std::complex<double> transform(std::complex<double> s) const;

 private:
  double step_ = 0.0;
  std::vector<double> force_;
};

}  // namespace carom::test
