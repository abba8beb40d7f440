#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <vector>

#include <carom/audio/material.h>
#include <carom/audio/modal_model.h>
#include <carom/audio/result.h>
#include <carom/audio/rigid_radiator.h>
#include <carom/audio/surface_mesh.h>
#include <carom/modal/analysis_settings.h>
#include <carom/modal/mesh_check.h>
#include <carom/modal/model_cache.h>

namespace carom {

/// A model, with the findings and the effort of its analysis.
struct MeshAnalysis {
  ModalModel model;
  std::vector<MeshFinding> findings;  ///< on the mesh as it was given
  std::optional<std::size_t> degreesOfFreedom;
  /// True if all frequencies of a solid are as exact as SolidSettings::accuracy asked for, by their
  /// own estimates; false, too, where a grid was set, or a shell.
  bool reachedAccuracy = false;
  std::optional<RadiationReport> radiation;
  bool isFromCache = false;  ///< if true, the effort and the radiation's report are not known
};

/// Makes a body that rings from a mesh.
///
///     SurfaceMesh --mended--> surface --solid or shell--> modes --boundary elements--> ModalModel
///
/// The surface is mended, analysed (a solid on a grid of splines, a shell as springs and masses),
/// and the radiation of its modes computed; each step is a function of its own, too. A model that
/// is in the cache already is not computed again. A body so small and stiff that all its modes lie
/// above hearing gives a model without modes.
///
/// Errors: those of needSolid for a solid; those of analyseSolid, shellModalModel and
/// computeRadiation; kCancelled. A cache that cannot be written is no error. [any thread but the
/// audio thread]
Result<MeshAnalysis> analyseMesh(const SurfaceMesh& mesh, const Material& material,
                                 const MeshAnalysisSettings& settings = {},
                                 ModelCache* cache = nullptr, const Progress& progress = {});

/// True if a model says how its modes radiate: by the volume that one of them moves, or more.
bool hasRadiation(const ModalModel& model);

/// Fills in how the modes of a model radiate if it does not say so, as models of other programs
/// do not (hasRadiation): from its surface, by computeRadiation, unless the cache has it. Decay
/// rates stay, as a model that was measured or computed elsewhere has all of them; what the modes
/// radiate becomes known as a part of that.
///
/// Errors: there are no triangles to compute it from; those of computeRadiation; kCancelled. The
/// model is as it was then. A cache that cannot be written is no error. [any thread but the audio
/// thread]
Status addRadiation(ModalModel& model, const RadiationSettings& settings = {},
                    ModelCache* cache = nullptr, const Progress& progress = {});

/// Solves how a rigid body pushes the air at every frequency (RigidRecoil): by boundary elements at
/// some 30 frequencies up to where the wave is 0.6 of its enclosing radius, then by the power of
/// plane waves from its surface; long waves are those of panelRadiator. `surface` is in m, body
/// frame, about the centre of mass. A recoil that is in the cache is not solved again.
///
/// Each coordinate plane that is a mirror plane of the surface makes it more exact in equal time, 3
/// to 15 s. Errors: those of panelRadiator, a mesh that loses its volume where it is simplified to
/// 450 panels, and kCancelled. A cache that cannot be written is no error. [any thread but the
/// audio thread]
Result<RigidRecoil> analyseRecoil(const SurfaceMesh& surface, ModelCache* cache = nullptr,
                                  const Progress& progress = {});

/// Returns a function for WorldSoundSettings::recoil: analyseRecoil with a cache of its own in
/// that folder, so that each shape is solved once on a machine. One thread at a time calls it.
RecoilSolver recoilSolver(std::filesystem::path cacheFolder = ModelCache::defaultFolder());

}  // namespace carom
