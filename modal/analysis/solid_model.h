#pragma once

#include <cstddef>

#include "carom/audio/material.h"
#include "carom/audio/modal_model.h"
#include "carom/audio/result.h"
#include "carom/modal/analysis_settings.h"
#include "modal/analysis/eigen_solver.h"
#include "modal/analysis/voxel_mesh.h"

namespace carom::modal {

/// A solid, free of supports, as masses and springs: M u'' + K u = f. u[3 n + axis] is the
/// displacement of node n along an axis of the body's frame.
struct SolidSystem {
  VoxelMesh grid;          ///< node positions are grid.nodes
  SparseMatrix stiffness;  ///< N/m
  SparseMatrix mass;       ///< kg, consistent: not diagonal
};

/// A model, with the size and the effort of its analysis.
struct SolidAnalysis {
  ModalModel model;
  std::size_t degreesOfFreedom = 0;
  Vec3 cellSize = Vec3::Zero();  ///< m
  Eigen::Index modesBeyond = 0;  ///< elastic modes up to kHighestMode that maxModes left out
  bool counted = false;          ///< no lower mode was missed: EigenSolution::counted
  Eigen::Index solves = 0;       ///< number of right-hand sides
};

/// Returns the linear, isotropic elasticity of a solid on the grid of its inside (voxelMesh,
/// solidElement). The grid's volume is off by what the samples in cut cells miss; stiffness and
/// mass are both scaled to the surface's own volume, so that the mass is exact.
///
/// Errors: those of voxelMesh, and a material that is not solid. [any thread], allocates.
Result<SolidSystem> solidSystem(const SurfaceMesh& surface, const Material& material,
                                const VoxelSettings& settings = {});

/// Returns the modes of a free solid body: the lowest of solidSystem, with the shapes at the
/// vertices of the surface as it was given (finer shapes need a finer surface). Mass, centre and
/// inertia are those of the grid: the mass is exact, the others are exact for boxes. Errors: those
/// of solidSystem and lowestModes, and cancelled. [any thread], allocates; about 5 s at 20 000
/// degrees of freedom.
Result<SolidAnalysis> analyseSolid(const SurfaceMesh& surface, const Material& material,
                                   const SolidSettings& settings = {},
                                   const Progress& progress = {});

/// Returns only the model of analyseSolid.
Result<ModalModel> solidModalModel(const SurfaceMesh& surface, const Material& material,
                                   const SolidSettings& settings = {},
                                   const Progress& progress = {});

}  // namespace carom::modal
