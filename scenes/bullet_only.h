#pragma once

#include <string>

#include "scenes/scene.h"

namespace carom::scenes {

/// Why the native stepper cannot run this scene: the first body of a kind that only Bullet moves,
/// in one sentence; empty where there is none. The other way round: whyNotOnBullet. [any thread]
std::string whyNotOnNative(const Scene& scene);

}  // namespace carom::scenes
