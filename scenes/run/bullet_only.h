#pragma once

#include "carom/audio/result.h"
#include "scenes/format/scene.h"

namespace carom::scenes {

/// Refuses a scene that the native stepper cannot run, in one sentence that names the first body of
/// a kind that only Bullet moves. Its counterpart is validateForBullet. [any thread]
Status validateForNative(const Scene& scene);

}  // namespace carom::scenes
