#pragma once

#include <complex>
#include <functional>

#include "carom/audio/material.h"
#include "carom/audio/vector.h"

namespace carom::test {

/// A round bar along x about the origin, free at both ends, in closed form.
struct FreeBar {
  Material material;
  double length = 0.3;    ///< m
  double radius = 0.004;  ///< m

  double mass() const;         ///< kg
  double turnInertia() const;  ///< kg m^2, about an axis across
};

/// A bending mode after Timoshenko 1921, shear coefficient of a round section after Cowper 1966.
/// The number-th one, from 1; odd ones are even in x.
class BendingMode {
 public:
  BendingMode(const FreeBar& bar, int number);

  double omega() const { return omega_; }  ///< rad/s
  /// 1/sqrt(kg), deflection of the axis; of shapes whose kinetic energy, rotation of sections
  /// included, is normalised.
  double deflection(double x) const;

 private:
  double determinant(double omega);

  FreeBar bar_;
  bool even_ = true;
  double omega_ = 0.0;
  std::complex<double> wave_[2];  // 1/m: cos(wave x), or sin
  std::complex<double> turn_[2];  // rotation of the section over deflection, 1/m
  std::complex<double> amount_[2];
};

/// What a slender bar radiates whose sections move across it along y, a(x) exp(i w t) in m/s^2: a
/// line of dipoles, each that of 2 rho0 pi radius^2 a dx (Lamb, Hydrodynamics, article 68: as much
/// added mass as displaced), times what is left of it where the section is no longer small: of an
/// endless cylinder, 1 over i pi z^2 / 2 H1'(z), z = k radius sin(angle to the axis), H of the
/// second kind (Junger and Feit, Sound, Structures, and Their Interaction, section 6.3).
/// Each end lacks what flows around it there: the line is shorter by `endLoss` radii at each end.
/// Pa at `listener`, near field of each dipole included.
std::complex<double> lineOfDipoles(const FreeBar& bar,
                                   const std::function<double(double)>& acceleration, double omega,
                                   const Vec3& listener, double endLoss);

}  // namespace carom::test
