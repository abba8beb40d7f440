#pragma once

#include <Eigen/Core>

#include "carom/audio/material.h"
#include "modal/analysis/eigen_solver.h"
#include "modal/analysis/spline_mesh.h"

namespace carom::modal {

/// Returns the loss factor (1) of each mode by heat that flows within the body from where the mode
/// presses it to where it stretches it (thermoelastic damping), 0 for the first `rigid`; nothing
/// for a material without thermal properties.
///
/// With e the dilatation, E and nu the material's and w the angular frequency: the mode takes part
/// with E integral(e^2) / ((1 - 2 nu)^2 w^2) of what a beam would, one of the thickness
/// sqrt(12 integral(e^2) / integral(|grad e|^2)), which thermoelasticLossFactor knows. That is
/// exact for thin sheets and beams of rectangular section in bending, at any frequency, and for any
/// body where heat does not get far in a period, but for what flows within that depth of its
/// surface (Landau, Lifshitz, Theory of Elasticity, paragraph 35). Within a cell, e counts as
/// linear. [any thread]
Eigen::VectorXd heatLosses(const SplineMesh& grid, const EigenSolution& solution,
                           Eigen::Index rigid, const Material& material);

}  // namespace carom::modal
