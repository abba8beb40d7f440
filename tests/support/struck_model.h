#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "carom/audio/modal_model.h"
#include "carom/audio/synth.h"
#include "modal/analysis/shell_model.h"
#include "tests/support/direct_vibration.h"
#include "tests/support/hertz_contact.h"

namespace carom::test {

/// One body twice: as matrices to be integrated, and as the modes of the same matrices.
struct StruckModel {
  DrivenBody direct;
  std::shared_ptr<const ModalModel> model;
  std::uint32_t vertex = 0;  ///< of the model's surface, where the body is hit
  Vec3 inward = Vec3::Zero();
  double analysisTime = 0.0;  ///< s, to find the modes
};

/// A closed surface as a network of springs, hit at the vertex that is farthest along `side`.
/// Motions that no spring resists must not move air: for transverse springs, the equal motion of
/// all vertices along their normals is removed from the force; for axial ones, it is the body's
/// rigid motion.
StruckModel struckShell(const SurfaceMesh& mesh, const Material& material,
                        const ShellSettings& settings, const Vec3& side);

/// A box on a grid of splines, with a surface of some hundreds of vertices.
StruckModel struckBox(const Vec3& half, const Material& material, std::size_t degreesOfFreedom,
                      const Vec3& side);

inline constexpr double kStrikeTime = 0.004;  ///< s on the synth's clock, of first touch
inline constexpr double kDistance = 1.0;      ///< m, of the listener from the centre of mass

/// Strike by a steel ball of 10 mm radius at 0.1 m/s, along the normal.
BallStrike strikeOf(const StruckModel& body);

/// Sound in Pa at 48 kHz from the clock's 0 on, in the band: of the modes' monopoles, as Synth
/// renders them, and of the volume's acceleration, rho0 / (4 pi r) V''(t - r / c).
std::vector<double> modalSound(const StruckModel& body, std::size_t frames);
std::vector<double> directSound(const StruckModel& body, double step, std::size_t frames);

/// Extrapolates the sound to a step of 0, as the trapezoidal rule's error goes with the step's
/// square.
std::vector<double> limitOf(const std::vector<double>& atStep, const std::vector<double>& atHalf);

}  // namespace carom::test
