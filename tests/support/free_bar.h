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
  double turnInertia() const;  ///< kg m^2, about an axis across the bar
};

/// A bending mode after Timoshenko 1921, with the shear coefficient of a round section after Cowper
/// 1966. `number` counts from 1; modes of odd number are even in x.
class BendingMode {
 public:
  BendingMode(const FreeBar& bar, int number);

  double omega() const { return omega_; }  ///< rad/s
  /// Deflection of the axis in 1/sqrt(kg): the shape is normalised to the kinetic energy, including
  /// the rotation of sections.
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

/// Pressure in Pa at `listener` of a slender bar whose sections move across it along y with a(x)
/// exp(i w t) in m/s^2, including the near field. It is a line of dipoles, each of 2 rho0 pi
/// radius^2 a dx (Lamb, Hydrodynamics, article 68: as much added mass as displaced). Where the
/// section is not small, each dipole is reduced as for an endless cylinder, by 1 over i pi z^2 / 2
/// H1'(z), z = k radius sin(angle to the axis), H of the second kind (Junger and Feit, Sound,
/// Structures, and Their Interaction, section 6.3). As air flows around the ends, the line is
/// shorter by `endLoss` radii at each end.
std::complex<double> lineOfDipoles(const FreeBar& bar,
                                   const std::function<double(double)>& acceleration, double omega,
                                   const Vec3& listener, double endLoss);

}  // namespace carom::test
