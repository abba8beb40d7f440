#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "carom/audio/material.h"
#include "carom/audio/modal_model.h"
#include "carom/audio/result.h"
#include "carom/audio/surface_mesh.h"
#include "carom/modal/analysis_settings.h"

namespace carom::modal {

/// A network of particles and springs at rest: m u'' + K u = f, where u are the displacements along
/// the normals, or three for each vertex.
///
/// N. Raghuvanshi, M. C. Lin, "Physically Based Sound Synthesis for Large-Scale Virtual
/// Environments", IEEE CG&A 27(1), 2007; Z. Ren, M. Lin, "Real-Time Sound Synthesis for Rigid
/// Bodies", Game Programming Gems 8, equation 1: m_i = rho t a_i, k = Y t. The area a_i of a vertex
/// is a third of its triangles'.
///
/// This is a model for games, not for plates: its stiffness is that of the mesh as much as that of
/// the body. Both m and k are proportional to the thickness, so that frequencies do not depend on
/// it; frequencies go with sqrt(Y / rho) / size, like those of stretching, which lie far above
/// those of bending. Poisson's ratio does not enter. FEM is for results that have to be right.
struct ShellNetwork {
  ShellSprings springs = ShellSprings::transverse;
  SurfaceMesh surface;                    ///< m, subdivided or simplified
  std::vector<Vec3> normals;              ///< unit, of each vertex
  Eigen::VectorXd masses;                 ///< kg, of each vertex, above 0
  Eigen::SparseMatrix<double> stiffness;  ///< N/m, symmetric; 1 or 3 rows for each vertex
};

/// Mends the mesh (`mended`), makes it as fine as the settings say and hangs the network on it. The
/// surface may be open; one with two sides counts once. Errors, each one sentence: settings or a
/// material out of range; no triangles, indices out of range, coordinates that are not finite; a
/// vertex without area; failures of simplification and subdivision. Parts that share no vertex
/// vibrate each by itself: checkMesh says so. [any thread]
Result<ShellNetwork> shellNetwork(const SurfaceMesh& mesh, const Material& material,
                                  const ShellSettings& settings);

/// Returns the modes of the network, with the mass, the centre of mass and the inertia of a shell
/// of that thickness. A transverse mode displaces each vertex along its normal. Errors: those of
/// shellNetwork; more than 3000 degrees of freedom; cancelled. Time grows with the third power of
/// their number: a few seconds for 1000. [any thread but the audio thread]
Result<ModalModel> shellModalModel(const SurfaceMesh& mesh, const Material& material,
                                   const ShellSettings& settings, const Progress& progress = {});

}  // namespace carom::modal
