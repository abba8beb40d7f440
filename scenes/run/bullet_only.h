#pragma once

#include <string>

#include "scenes/format/scene.h"

namespace carom::scenes {

/// Returns why the native stepper cannot run this scene: one sentence that names the first body of
/// a kind that only Bullet moves, or an empty string if it can. Its counterpart is whyNotOnBullet.
/// [any thread]
std::string whyNotOnNative(const Scene& scene);

}  // namespace carom::scenes
