#pragma once

#include <memory>

#include "carom/audio/result.h"
#include "scenes/format/scene.h"
#include "scenes/run/scene_stepper.h"

namespace carom::scenes {

/// Makes a stepper on Bullet at the scene's start. Refuses scenes that Bullet cannot run, and in a
/// build without Bullet all. [one thread]
Result<std::unique_ptr<LiveStepper>> bulletStepper(const Scene& scene);

}  // namespace carom::scenes
