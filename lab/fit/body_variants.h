#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "lab/fit/mode_match.h"

#include "carom/audio/material.h"
#include "carom/audio/modal_model.h"
#include "carom/audio/result.h"
#include "carom/audio/surface_mesh.h"
#include "carom/modal/analysis_settings.h"
#include "carom/modal/model_cache.h"

namespace carom::lab {

/// The properties of a body that are varied to see how its frequencies follow.
struct BodyVariant {
  double poissonsRatio = 0.3;  ///< 1
  double wall = 0.0;           ///< m, by which walls are thicker than the mesh's
};

/// Analyses variants of one mesh, of one Young's modulus and density: the modes without damping and
/// radiation. [one thread]
class BodyVariants {
 public:
  /// `material` gives Young's modulus and density. The progress is called with shares of one
  /// analysis each.
  BodyVariants(SurfaceMesh mesh, Material material, std::size_t maxModes, ModelCache* cache,
               Progress progress);

  /// Returns the modes of a variant; an error of analyseMesh.
  Result<ModalModel> analysed(const BodyVariant& variant) const;
  const Material& material() const { return material_; }
  const SurfaceMesh& mesh() const { return mesh_; }

 private:
  SurfaceMesh mesh_;
  Material material_;
  std::size_t maxModes_;
  ModelCache* cache_;
  Progress progress_;
};

/// Returns the frequencies of a model with the bounds of their errors.
std::vector<ComputedLine> linesOfModel(const ModalModel& model);

/// Returns for each mode of `model` the logarithm of the frequency that it has in `other`, a model
/// of nearly the same body, over its own: modes are told by their shapes (modal assurance
/// criterion: Allemang 2003), as they may change places. [any thread]
std::vector<double> frequencyShifts(const ModalModel& model, const ModalModel& other);

}  // namespace carom::lab
