#pragma once

#include <cstddef>

#include "carom/audio/material.h"
#include "carom/audio/modal_model.h"
#include "carom/audio/result.h"
#include "carom/modal/analysis_settings.h"
#include "modal/eigen_solver.h"
#include "modal/voxel_mesh.h"

namespace carom::modal {

/// A solid as masses and springs: M u'' + K u = f, free of supports. Of node n, u[3 n + axis] is
/// the displacement along an axis of the body's frame.
struct SolidSystem {
  VoxelMesh grid;          ///< node positions are grid.nodes
  SparseMatrix stiffness;  ///< N/m
  SparseMatrix mass;       ///< kg, consistent: not diagonal
};

/// A model, and what its analysis took.
struct SolidAnalysis {
  ModalModel model;
  std::size_t degreesOfFreedom = 0;
  Vec3 cellSize = Vec3::Zero();  ///< m
  Eigen::Index modesBeyond = 0;  ///< elastic ones up to kHighestMode that maxModes left out
  bool counted = false;          ///< that no lower mode was missed: EigenSolution::counted
  Eigen::Index solves = 0;       ///< right-hand sides
};

/// Linear, isotropic elasticity of a solid on the grid of its inside (voxelMesh, solidElement). The
/// grid's volume is off by what the samples in cut cells miss; stiffness and mass are both scaled
/// to the surface's own volume, so that the mass is exact.
///
/// Errors: those of voxelMesh, and a material that is not solid. [any thread], allocates.
Result<SolidSystem> solidSystem(const SurfaceMesh& surface, const Material& material,
                                const VoxelSettings& settings = {});

/// The modes of a free solid body: the lowest of solidSystem, with the shapes at the vertices of
/// the surface as it was given (finer shapes want a finer surface). Mass, centre and inertia are
/// those of the grid: the mass is exact, the others are for boxes. Errors: those of solidSystem and
/// lowestModes, and cancelled. [any thread], allocates; about 5 s at 20 000 degrees of freedom.
Result<SolidAnalysis> analyseSolid(const SurfaceMesh& surface, const Material& material,
                                   const SolidSettings& settings = {},
                                   const Progress& progress = {});

/// analyseSolid, the model only.
Result<ModalModel> solidModalModel(const SurfaceMesh& surface, const Material& material,
                                   const SolidSettings& settings = {},
                                   const Progress& progress = {});

}  // namespace carom::modal
