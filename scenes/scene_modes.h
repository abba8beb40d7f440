#pragma once

#include <memory>
#include <vector>

#include "carom/audio/modal_model.h"
#include "carom/audio/result.h"
#include "carom/modal/analysis_settings.h"
#include "scenes/scene.h"

namespace carom::scenes {

/// How a body of a scene rings.
struct BodyModes {
  std::shared_ptr<const ModalModel> model;  ///< null: it does not
  Vec3 origin = Vec3::Zero();               ///< m, model frame: where the body's own origin is
};

/// Of all bodies, in their order. Models are read or computed once for all that have the same, and
/// what was computed before comes out of the cache (ModelCache). An error names the body.
/// [one thread]
Result<std::vector<BodyModes>> sceneModes(const Scene& scene, const Progress& progress = {});

}  // namespace carom::scenes
