#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "audio/material.h"
#include "audio/medium.h"
#include "audio/modal_model.h"
#include "audio/result.h"
#include "audio/surface_mesh.h"
#include "modal/mesh_check.h"
#include "modal/mode_radiation.h"
#include "modal/model_cache.h"
#include "modal/progress.h"
#include "modal/shell_model.h"
#include "modal/solid_model.h"

namespace carom {

enum class BodyModel : std::uint8_t {
  solid,  ///< finite elements of what the surface encloses: what has to be right
  shell,  ///< masses and springs on the surface: a game's model, for what is open or thin
};

/// All that decides what the modes of a mesh become.
struct MeshAnalysisSettings {
  BodyModel body = BodyModel::solid;
  SolidSettings solid = {};  ///< of a solid
  ShellSettings shell = {};  ///< of a shell
  /// The surface of a solid's model: a coarser mesh is subdivided, so that shapes are followed
  /// between its vertices; a finer one is simplified, as each vertex costs 12 bytes for each mode.
  std::size_t leastVertices = 500;
  std::size_t mostVertices = 3000;
  /// None: modes have their volume alone, and all but monopoles are silent, or constant.
  std::optional<RadiationSettings> radiation = RadiationSettings{};
  Medium medium = {};

  bool operator==(const MeshAnalysisSettings&) const = default;
};

/// A model, and what it took.
struct MeshAnalysis {
  ModalModel model;
  std::vector<MeshFinding> findings;  ///< of the mesh as it was given
  std::optional<std::size_t> degreesOfFreedom;
  std::optional<RadiationReport> radiation;
  bool isFromCache = false;  ///< then the two above are not known
};

/// From a mesh to a body that rings: mends the surface, analyses it, and computes how its modes
/// radiate. What is in the cache already is not computed again. A body so small and stiff that all
/// its modes lie above hearing gives a model without modes.
///
/// Errors: of a solid, what needSolid says; those of analyseSolid, shellModalModel and
/// computeRadiation; kCancelled. A cache that cannot be
/// written is no error. [any thread but the audio thread]
Result<MeshAnalysis> analyseMesh(const SurfaceMesh& mesh, const Material& material,
                                 const MeshAnalysisSettings& settings = {},
                                 ModelCache* cache = nullptr, const Progress& progress = {});

}  // namespace carom
