#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "audio/contact/coupled_contact.h"
#include "carom/audio/material.h"
#include "carom/audio/surface_mesh.h"

namespace carom::test {

/// A disc on a body's surface over which a contact's force is spread.
struct Patch {
  Vec3 centre = Vec3::Zero();    ///< m
  Vec3 inward = -Vec3::UnitZ();  ///< unit
  double radius = 0.0;           ///< m
  double wall = 0.0;             ///< m, the body's thickness there
};

/// A free body as masses and springs, M u'' + beta K u' + K u = F push, which gives way to a
/// contact by push . u.
struct PatchedBody {
  Eigen::SparseMatrix<double> mass = {};       ///< kg
  Eigen::SparseMatrix<double> stiffness = {};  ///< N/m
  double beta = 0.0;                           ///< s
  Eigen::VectorXd push = {};                   ///< 1, for each degree of freedom
  /// m/N: by how much more the patch gives way than the wall behind it does on average. This dent
  /// is the mesh's idea of what Hertz's law says, which must not count twice.
  double dent = 0.0;
};

/// A solid as modal::solidSystem has it.
PatchedBody patchedSolid(const SurfaceMesh& surface, const Material& material,
                         std::size_t degreesOfFreedom, const Patch& patch);
/// A network of axial springs (modal::shellNetwork), pushed at the vertices within the patch's
/// radius; all that it gives way is its own.
PatchedBody patchedShell(const SurfaceMesh& surface, const Material& material, const Patch& patch);

/// The modes of a body as a contact feels them.
struct PatchModes {
  Eigen::MatrixXd rigid = {};                  ///< 1/sqrt(kg), a column for each
  double mobility = 0.0;                       ///< 1/kg, of the rigid ones
  std::vector<audio::ContactMode> modes = {};  ///< elastic ones up to the highest
  /// m/N: by how much the modes above give way to a force that lasts, less the dent.
  double beyond = 0.0;
};
/// Finds the modes of the same matrices, up to `highest` (Hz).
PatchModes modesOf(const PatchedBody& body, double highest);

/// A ball that falls onto the patch. The body's own weight is carried.
struct DirectBlow {
  double mass = 0.0;       ///< kg, of the ball
  double speed = 1.0;      ///< m/s
  double stiffness = 0.0;  ///< N/m^(3/2)
  double damping = 0.0;    ///< s/m: chi of Hunt and Crossley's law
  double gravity = 9.81;   ///< m/s^2, on the ball
};

struct DirectCourse {
  double step = 0.0;               ///< s
  std::vector<double> force = {};  ///< N, at 0, step, 2 step...
  double deepest = 0.0;            ///< m, of the contact's own dent
  std::size_t touches = 0;
  // J, as of the end of the last touch:
  double rigid = 0.0;  ///< of the rigid bodies' relative motion
  double modes = 0.0;  ///< in the body, but for its rigid motion
  double lost = 0.0;   ///< taken by the contact
};

/// Integrates body and ball together by the trapezoidal rule (Newmark 1959), whose matrix is
/// factorised once; the force at the end of each step is found such that it obeys
/// F = K d^(3/2) (1 + chi d') there, with d the approach less what the body gives way, its dent
/// excepted.
DirectCourse integrate(const PatchedBody& body, const PatchModes& modes, const DirectBlow& blow,
                       double step, double until);

}  // namespace carom::test
