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
};

/// Gives the model the modes that can be heard, with the damping of its material, and counts the
/// others. `model.surface` and `model.material` must be set. A mode is rigid if its lambda is below
/// `rigidBelow` (rad^2/s^2), which belongs to the solver's accuracy. [any thread]
void keepAudibleModes(ModalModel& model, const EigenModes& found, double rigidBelow);

}  // namespace carom::modal
