#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "carom/audio/material.h"
#include "carom/audio/vector.h"

namespace carom::test {

// Theory of the vibration of simple free bodies. The functions return undamped frequencies in Hz,
// ascending, without the rigid modes; a frequency is repeated for each of its shapes. Edges are in
// m. Results are the same on each call. The code shares nothing with modal/.
//
// Ritz's method stands for closed forms that do not exist: Legendre polynomials leave free ends and
// edges free, and converge so fast that the degrees used here are exact to 1e-4 or better.

/// Timoshenko's beam between free ends; it bends in the plane of `length` and `depth`.
std::vector<double> bendingFrequencies(const Material& material, double length, double depth,
                                       double width, std::size_t count);

/// The shear coefficient of Timoshenko's beam, after Hutchinson, J. Appl. Mech. 68 (2001) 87: 5 (1
/// + nu) / (6 + 5 nu) if narrow; above 1 if the beam is so wide that it begins to bend as a plate
/// does.
double shearCoefficient(double depth, double width, double poissonsRatio);

/// Saint-Venant's torsion of a rectangle: twist gradient = torque / (G constant), and the axial
/// displacement is the twist gradient times a function of the section.
struct RectangleTorsion {
  double constant = 0.0;  ///< m^4
  double warping = 0.0;   ///< m^6, integral of that function's square
};
RectangleTorsion rectangleTorsion(double width, double thickness);

/// Saint-Venant's torsion between ends that are free to warp, with the axial stresses and the
/// inertia of the warping (Vlasov's theory; Gere, J. Appl. Mech. 21 (1954) 381).
std::vector<double> twistingFrequencies(const Material& material, double length, double width,
                                        double thickness, std::size_t count);

/// A rod with the inertia of its lateral contraction: Love, Mathematical Theory of Elasticity,
/// section 278.
std::vector<double> stretchingFrequencies(const Material& material, double length, double width,
                                          double thickness, std::size_t count);

/// A thin square plate with free edges, after Kirchhoff, by Ritz's method as Leissa, J. Sound Vib.
/// 31 (1973) 257, with more terms. Bending only.
std::vector<double> squarePlateFrequencies(const Material& material, double side, double thickness,
                                           std::size_t count);

/// A solid sphere: Lamb, Proc. London Math. Soc. 13 (1882) 189; the frequency equation of the
/// spheroidal modes as Eringen and Suhubi, Elastodynamics II (1975), section 8.13.
std::vector<double> sphereFrequencies(const Material& material, double radius, std::size_t count);

/// A mode of a box with edges along the axes, centred at the origin.
struct BoxMode {
  double frequency = 0.0;     ///< Hz
  std::array<bool, 3> odd{};  ///< true if reflection of that coordinate reverses the motion
};

/// The modes of a box in three-dimensional elasticity by Ritz's method, with polynomials up to
/// `degrees` along the axes: Demarest, J. Acoust. Soc. Am. 49 (1971) 768. The frequencies converge
/// from above.
std::vector<BoxMode> boxModes(const Material& material, const Vec3& edges,
                              const std::array<int, 3>& degrees, std::size_t count);

}  // namespace carom::test
