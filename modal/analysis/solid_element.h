#pragma once

#include <array>

#include <Eigen/Core>

#include "carom/audio/material.h"
#include "modal/analysis/cell_moments.h"
#include "modal/analysis/grid_axis.h"

namespace carom::modal {

/// Functions that a cell carries: products of four cubic ones along each axis, x fastest.
inline constexpr int kCellFunctions = 64;

/// Stiffness, mass and pull of one cell. Rows and columns go function by function, three for each
/// in stiffness and pull.
struct ElementMatrices {
  Eigen::MatrixXd stiffness;  ///< N/m, grid frame; 192 x 192
  Eigen::MatrixXd mass;       ///< kg, the same in each direction; 64 x 64
  /// m^2, grid frame: the forces of a pull of 1 Pa outwards on the whole surface; 192. By the
  /// divergence theorem they are the integrals of the functions' gradients over the inside.
  Eigen::VectorXd pull;
};

/// A cell's three sides.
using CellAxes = std::array<const AxisCell*, 3>;

/// Returns linear, isotropic elasticity and consistent mass of a cell whose inside has these
/// moments, with displacements in cubic B-splines. All integrals are exact. [any thread]
ElementMatrices solidElement(const CellAxes& cell, const CellMoments& inside,
                             const Material& material);

}  // namespace carom::modal
