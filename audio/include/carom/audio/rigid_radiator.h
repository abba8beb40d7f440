#pragma once

#include <Eigen/Core>

#include <carom/audio/vector.h>

namespace carom {

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

/// Radiator of a sphere (radius in m): the added volume is half the displaced one in each
/// direction, and none in rotation. [any thread]
RigidRadiator sphereRadiator(double radius);

/// Radiator of an ellipsoid about its centre, semi-axes in m, all > 0, along x, y, z, in closed
/// form: Lamb, Hydrodynamics, 6th ed., articles 114 and 115; his integrals by Carlson's R_D
/// (Carlson 1979). Exact to 1e-10 of the largest component, for axes in ratios up to 1e4.
/// [any thread]
RigidRadiator ellipsoidRadiator(const Vec3& semiAxes);

}  // namespace carom
