#pragma once

#include <complex>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <carom/audio/material.h>
#include <carom/audio/result.h>
#include <carom/audio/surface_mesh.h>
#include <carom/audio/vector.h>

namespace carom {

/// The band in which modes are kept.
inline constexpr double kLowestMode = 20.0;      ///< Hz
inline constexpr double kHighestMode = 20000.0;  ///< Hz

/// The sound radiation of one mode: the pressure of a steady oscillation q(t) = Re(Q exp(i w t)) of
/// the modal coordinate (m sqrt(kg)), at the point r (unit direction d, distance r) from the centre
/// of mass, is
///
///     p = -w^2 Q exp(-i k r) / r  sum_lm  c_lm R_l(k r) Y_lm(d),    k = w / c
///
/// with the real orthonormal spherical harmonics Y_lm (no Condon-Shortley phase), in the model's
/// frame, m from -l to l, index l^2 + l + m; and with R_l = i^(-l-1) h_l^(2)(kr) kr exp(i k r),
/// which is 1 far away. So sum c_lm Y_lm is the far field times the distance. Exact outside of the
/// smallest sphere about the centre of mass that holds the body, as far as the c_lm are.
struct ModeRadiation {
  /// m^2 / sqrt(kg), the integral of the shape's outward normal component over the surface: the
  /// monopole of long waves is -w^2 Q rho0 volume / (4 pi r).
  double volume = 0.0;
  /// kg / (m^3) m^2 / sqrt(kg) = sqrt(kg) / m: c_lm, (order + 1)^2 of them. Empty: not computed.
  std::vector<std::complex<double>> multipoles;
  /// 1/s, the part of Mode::decayRate by which the mode loses its energy as sound, in the model's
  /// medium. 0: not known, or left out.
  double decayRate = 0.0;
};

/// One mode of vibration of a free body.
struct Mode {
  double frequency = 0.0;  ///< Hz, undamped: sqrt(lambda) / (2 pi)
  /// 1/s, amplitude falls as exp(-decayRate t): what the material takes, dampingRate, heatDecayRate
  /// and ModeRadiation::decayRate.
  double decayRate = 0.0;
  ModeRadiation radiation;
  /// 1, an estimate of how far the frequency may be off, relative to it, by the discretisation of
  /// the analysis; not what the material or the mesh are off by. 0: not known.
  double frequencyError = 0.0;
  /// 1/s, the part of decayRate that is lost by heat which flows from where the mode presses the
  /// material to where it stretches it. 0: not known, or left out.
  double heatDecayRate = 0.0;
};

/// Numbers of modes that an analysis found and left out.
struct ModesLeftOut {
  std::uint32_t rigid = 0;       ///< lambda = 0: the body moves as a whole (or a part of it does)
  std::uint32_t below = 0;       ///< lower than kLowestMode
  std::uint32_t above = 0;       ///< higher than kHighestMode, as far as the analysis came across
  std::uint32_t overdamped = 0;  ///< decayRate >= 2 pi frequency: does not oscillate
};

/// A body that rings: its modes of vibration, and where they can be excited. Immutable in use, to
/// be shared by all bodies of one shape and material.
///
/// Its frame is that of the mesh it was made from. A body's own frame has the same axes, and its
/// origin at `centreOfMass`.
///
/// Linear vibration of a body that nothing holds, with modal damping. Shapes are
/// normalised by mass: phi^T M phi = 1. A force f at vertex v excites mode i by shape(i, v) . f.
struct ModalModel {
  std::string name;
  Material material;
  double mass = 0.0;                                  ///< kg, of the vibrating body
  Vec3 centreOfMass = Vec3::Zero();                   ///< m, model frame
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  ///< kg m^2, about the centre of mass
  SurfaceMesh surface;                                ///< m, model frame: where it can be hit
  std::vector<Mode> modes;                            ///< ascending in frequency
  /// 1/sqrt(kg), model frame: the displacement of vertex v in mode i is shape(i, v) times q_i. Mode
  /// by mode, three numbers for each vertex of `surface`.
  std::vector<float> shapes;
  /// m^3/N, model frame: the volume that the modes which are not among `modes` displace outwards
  /// under a steady force of 1 N on vertex v (residual flexibility, the static correction of a
  /// truncated series of modes), three numbers for each vertex of `surface`. Empty: not known.
  std::vector<float> residualVolumes;
  /// Hz, above 0 where there are residualVolumes: where those modes lie, in the mean weighted by
  /// what they displace.
  double residualFrequency = 0.0;
  Medium medium;  ///< the medium that the radiation was computed for
  ModesLeftOut leftOut;

  Vec3 shape(std::size_t mode, std::size_t vertex) const {
    const float* at = &shapes[3 * (mode * surface.vertices.size() + vertex)];
    return Vec3(at[0], at[1], at[2]);
  }
  Vec3 residualVolume(std::size_t vertex) const {
    if (residualVolumes.empty()) return Vec3::Zero();
    const float* at = &residualVolumes[3 * vertex];
    return Vec3(at[0], at[1], at[2]);
  }
};

/// Refuses a model with values out of range, of which it checks all; the message begins with the
/// field. [any thread]
Status validate(const ModalModel& model);

}  // namespace carom
