#pragma once

#include <span>

#include <Eigen/Core>

#include "carom/audio/material.h"
#include "modal/analysis/voxel_mesh.h"

namespace carom::modal {

/// Stiffness and mass of one cell. Rows and columns go node by node, in the order of its corners,
/// three for each node in the stiffness.
struct ElementMatrices {
  Eigen::Matrix<double, 24, 24> stiffness;  ///< N/m, grid frame
  Eigen::Matrix<double, 8, 8> mass;         ///< kg, the same in each direction
};

/// Returns linear, isotropic elasticity and consistent mass on a brick, integrated over those of
/// its parts that are inside the body; over all of it if none are named.
///
/// Eight nodes with trilinear displacement, and the incompatible modes 1 - xi^2, 1 - eta^2,
/// 1 - zeta^2 (Wilson, Taylor, Doherty, Ghaboussi 1973), which let a single layer bend, condensed
/// out. Their gradients are taken less their mean over the inside (as in Taylor, Beresford, Wilson
/// 1976), which in a whole brick is 0, so that constant strain is represented exactly in cut cells,
/// too. All integrals are exact on the boxes given. [any thread]
ElementMatrices solidElement(const Vec3& cellSize, std::span<const CellBox> inside,
                             const Material& material);

}  // namespace carom::modal
