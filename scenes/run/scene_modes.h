#pragma once

#include <memory>
#include <vector>

#include "carom/audio/modal_model.h"
#include "carom/audio/result.h"
#include "carom/audio/surface_mesh.h"
#include "carom/modal/analysis_settings.h"
#include "scenes/format/scene.h"

namespace carom::scenes {

/// The modes of a body of a scene.
struct BodyModes {
  std::shared_ptr<const ModalModel> model;  ///< null: the body does not ring
  Vec3 origin = Vec3::Zero();               ///< m, model frame: the body's own origin
};

/// A model that is computed from the shape of a body.
struct ModesToCompute {
  const SceneBody* body = nullptr;  ///< the first body that has it
  SurfaceMesh surface;              ///< m, body frame
};

/// Returns the models that sceneModes computes, each once; those in the cache too. [any thread]
std::vector<ModesToCompute> modesToCompute(const Scene& scene);

/// Returns the modes of all bodies, in the order of the bodies. A model that several bodies have is
/// read or computed once, and one that was computed before is taken from the cache (ModelCache). An
/// error names the body. [one thread]
Result<std::vector<BodyModes>> sceneModes(const Scene& scene, const Progress& progress = {});

}  // namespace carom::scenes
