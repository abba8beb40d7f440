#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <carom/audio/material.h>
#include <carom/audio/modal_model.h>
#include <carom/audio/result.h>
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
  std::optional<RadiationReport> radiation;
  bool isFromCache = false;  ///< if true, the two above are not known
};

/// Makes a body that rings from a mesh.
///
///     SurfaceMesh --mended--> surface --solid or shell--> modes --boundary elements--> ModalModel
///
/// The surface is mended, analysed (a solid as a grid of bricks, a shell as springs and masses),
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

}  // namespace carom
