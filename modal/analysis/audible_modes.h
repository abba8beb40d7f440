#pragma once

#include <Eigen/Core>

#include "carom/audio/modal_model.h"

namespace carom::modal {

/// The eigenvalues and eigenvectors of K phi = lambda M phi.
struct EigenModes {
  Eigen::VectorXd lambda;  ///< rad^2/s^2, ascending; those of rigid modes are within rounding of 0
  /// Mode shapes in 1/sqrt(kg), one column for each mode, three rows for each vertex of the
  /// surface; phi^T M phi = 1 of the whole body.
  Eigen::MatrixXd shapes;
  Eigen::VectorXd errors = {};  ///< 1, of the frequencies (Mode::frequencyError); empty: not known
  /// 1, by how much the frequencies are known to be too high; empty: by nothing.
  Eigen::VectorXd excess = {};
  Eigen::VectorXd heatLosses = {};  ///< 1, loss factors by heat that flows; empty: not computed
};

/// How a surface gives way to a load that pulls each of its triangles outwards by 1 Pa.
struct StaticResponse {
  /// m, three rows for each vertex: (K - shift M)^-1 load, or that less its rigid modes.
  Eigen::VectorXd displacement;
  double shift = 0.0;          ///< rad^2/s^2, 0 or less
  double massMoment = 0.0;     ///< kg m^2: u^T M u of the whole body's displacement u
  bool hasRigidModes = false;  ///< they are in the displacement
  /// m^2 / sqrt(kg), how far that load pulls each mode; empty: by its shape at the vertices.
  Eigen::VectorXd pulls = {};
};

/// Returns the forces (N) of that load on the vertices, three rows for each.
Eigen::VectorXd outwardLoad(const SurfaceMesh& surface);

/// Gives the model what the modes that were not found, or lie above the band, displace
/// (ModalModel::residualVolumes): by reciprocity, the volume that a force on a vertex displaces is
/// how far the load of outwardLoad moves that vertex. Nothing, where rounding leaves nothing.
void keepResidual(ModalModel& model, const EigenModes& found, const StaticResponse& response,
                  double rigidBelow);

/// Gives the model the modes that can be heard, with the damping of its material, and counts the
/// others. `model.surface` and `model.material` must be set. A mode is rigid if its lambda is below
/// `rigidBelow` (rad^2/s^2), which belongs to the solver's accuracy. [any thread]
void keepAudibleModes(ModalModel& model, const EigenModes& found, double rigidBelow);

}  // namespace carom::modal
