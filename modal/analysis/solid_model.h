#pragma once

#include <cstddef>
#include <vector>

#include "carom/audio/material.h"
#include "carom/audio/modal_model.h"
#include "carom/audio/result.h"
#include "carom/modal/analysis_settings.h"
#include "modal/analysis/eigen_solver.h"
#include "modal/analysis/spline_mesh.h"

namespace carom::modal {

/// A solid, free of supports, as masses and springs: M u'' + K u = f. u[3 n + axis] is the
/// coefficient of node n along an axis of the body's frame.
struct SolidSystem {
  SplineMesh grid;
  SparseMatrix stiffness;  ///< N/m
  SparseMatrix mass;       ///< kg, consistent: not diagonal
  Eigen::VectorXd pull;    ///< m^2, the forces of a pull of 1 Pa outwards on the whole surface
  std::vector<int> order;  ///< of the rows, in which little fills (dissectionOrder)
};

/// A model, with the size and the effort of its analysis.
struct SolidAnalysis {
  ModalModel model;  ///< each mode with the estimate of its frequency's error
  std::size_t degreesOfFreedom = 0;
  Vec3 cellSize = Vec3::Zero();  ///< m
  Eigen::Index modesBeyond = 0;  ///< elastic modes up to kHighestMode that maxModes left out
  bool counted = false;          ///< no lower mode was missed: EigenSolution::counted
  Eigen::Index solves = 0;       ///< number of right-hand sides, on the last grid
  std::size_t grids = 0;         ///< grids that were solved, the last one included
  /// True if all errors are within SolidSettings::accuracy; not where a grid was set.
  bool reachedAccuracy = false;
};

/// Returns the linear, isotropic elasticity of a solid on the grid of its inside (splineMesh,
/// solidElement).
///
/// Errors: those of splineMesh, a material that is not solid, and cancelled. [any thread],
/// allocates.
Result<SolidSystem> solidSystem(const SurfaceMesh& surface, const Material& material,
                                const GridSettings& settings = {}, const Progress& progress = {});

/// A body's surface, for two uses that may ask for different detail.
struct SolidSurface {
  const SurfaceMesh& body;    ///< what the solid is inside of
  const SurfaceMesh& shapes;  ///< the model's surface: shapes are taken at its vertices
};

/// Returns the modes of a free solid body: the lowest of solidSystem. Mass, centre and inertia are
/// exact, for bodies that do not overlap.
///
/// Grids of some 1200 degrees of freedom and of 2.2 times as many each time are solved until the
/// errors are within the accuracy asked for, or the next one would be beyond kMostEntries: half a
/// minute, 4 GB. A frequency's error is taken from its change since the grid before, as if it fell
/// with the power 2.5 of the size of a cell, or from its last two changes. What sharp inner edges
/// that the grid has no lines for (SplineMesh::openCells) make a frequency too high by is estimated
/// from the mode's energy beside them and taken off. Where a grid is set, two coarser ones are
/// solved for the errors.
///
/// Errors: those of solidSystem and lowestModes, and cancelled. [any thread], allocates.
Result<SolidAnalysis> analyseSolid(const SolidSurface& surface, const Material& material,
                                   const SolidSettings& settings = {},
                                   const Progress& progress = {});

/// The same for a surface of which all is used.
Result<SolidAnalysis> analyseSolid(const SurfaceMesh& surface, const Material& material,
                                   const SolidSettings& settings = {},
                                   const Progress& progress = {});

/// Returns only the model of analyseSolid.
Result<ModalModel> solidModalModel(const SurfaceMesh& surface, const Material& material,
                                   const SolidSettings& settings = {},
                                   const Progress& progress = {});

}  // namespace carom::modal
