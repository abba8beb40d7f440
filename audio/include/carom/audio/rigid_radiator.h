#pragma once

#include <complex>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include <Eigen/Core>

#include <carom/audio/result.h>
#include <carom/audio/vector.h>

namespace carom {

struct SurfaceMesh;

/// The quantities by which a rigid body of any shape pushes the air while it is small against the
/// wavelength: its volume, and the added mass of the potential flow around it. Body frame, about
/// the body's origin, which `dipole` takes for its centre of mass. Immutable in use. [any thread]
///
/// Far away the pressure of a body with acceleration A(t) is that of a dipole,
///
///     p(x, t) = rho0 x^ . (d/dt dipole(A, alpha))(t - r/c) / (4 pi c r)
///
/// (Howe 2003, section 2.2; Chadwick, Zheng, James 2012 for the sphere). Not modelled: terms of
/// second order in the speeds (gyroscopic, centripetal), wavelengths near the body's size.
struct RigidRadiator {
  double volume = 0.0;           ///< m^3
  Vec3 centroid = Vec3::Zero();  ///< m, of the volume
  /// Added mass over the fluid's density: m^3 (translation), m^4 (mixed), m^5 (rotation), in the
  /// order translation x, y, z, rotation x, y, z about the origin. Symmetric, positive
  /// semidefinite.
  Mat6 addedVolume = Mat6::Zero();

  /// Radius in m of the sphere that pushes as much air in the mean over directions, with 3/2 (4/3
  /// pi a^3) = volume + trace of the translational part / 3.
  double radius() const;

  /// Dipole strength over the fluid's density in m^4/s^2, body frame, for the acceleration of the
  /// origin (m/s^2) and the angular acceleration (rad/s^2), both as seen in the body frame.
  Vec3 dipole(const Vec3& linear, const Vec3& angular) const;

  /// Returns the radiator of the same body about another origin (m, in the present frame), axes
  /// kept.
  RigidRadiator about(const Vec3& origin) const;

  /// Returns the radiator of the same body in a frame turned by `rotation` (old frame to new).
  RigidRadiator turned(const Eigen::Matrix3d& rotation) const;
};

// The layout is the same for every host, whatever vector instructions it is compiled with.
static_assert(sizeof(RigidRadiator) == 320 && alignof(RigidRadiator) == alignof(double));

/// The way in which a rigid body of any shape pushes the air at every frequency: its six motions,
/// each as multipoles, each of these a sum of decaying oscillations that all have in common. Body
/// frame, about the body's origin, its centre of mass. Immutable in use. [any thread]
///
/// A body whose acceleration has the spectrum A_j(s), m/s^2 along x, y, z for j = 0 to 2 and
/// rad/s^2 about them for j = 3 to 5, is heard far away in the direction d with, s' = s radius / c,
///
///     p = rho0 radius^2 / r * e^(-s (r - radius)/c) * sum_j radius^[j > 2] A_j(s) h_j(d, s')
///     h_j(d, s') = sum over terms of motion j, Y_lm(d) sum_n  R_n / (s' - P_n) + its conjugate
///
/// with Y_lm real and orthonormal, by l^2 + l + m. It holds for any size and any medium.
struct RigidRecoil {
  /// A multipole of a motion.
  struct Term {
    std::uint16_t motion = 0;    ///< 0 to 5: along x, y, z, about x, y, z
    std::uint16_t harmonic = 0;  ///< l^2 + l + m
  };
  static constexpr std::size_t kMostPoles = 24;
  static constexpr int kHighestOrder = 24;  ///< l of a term, at most

  double radius = 0.0;  ///< m, of the sphere about the origin that holds the body
  /// One of each conjugate pair, c / radius, its real part below 0, the imaginary above.
  std::vector<std::complex<double>> poles;
  std::vector<Term> terms;  ///< in order of motion, then of harmonic
  /// R_n of each term: poles.size() in a row.
  std::vector<std::complex<float>> residues;
};

/// Refuses a recoil whose sizes do not fit together, that grows instead of decaying, or that has a
/// value out of range; the message begins with the field. [any thread]
Status validate(const RigidRecoil& recoil);

/// Solves the recoil of a surface (m, body frame, about the centre of mass), as recoilSolver of
/// carom::modal does. It may ask `goesOn` now and then: once that is false, the result is not
/// wanted any more. It must not throw.
using RecoilSolver = std::function<Result<RigidRecoil>(const SurfaceMesh& surface,
                                                       const std::function<bool()>& goesOn)>;

/// Radiator of a sphere (radius in m): the added volume is half the displaced one in each
/// direction, and none in rotation. [any thread]
RigidRadiator sphereRadiator(double radius);

/// Radiator of an ellipsoid about its centre, semi-axes in m, all > 0, along x, y, z, in closed
/// form: Lamb, Hydrodynamics, 6th ed., articles 114 and 115; his integrals by Carlson's R_D
/// (Carlson 1979). Exact to 1e-10 of the largest component, for axes in ratios up to 1e4.
/// [any thread]
RigidRadiator ellipsoidRadiator(const Vec3& semiAxes);

}  // namespace carom
