#pragma once

#include <string>

#include "scenes/format/scene.h"

namespace carom::scenes {

/// Returns why Bullet cannot run this scene: one sentence that lists all features in it that only
/// the native stepper has, or an empty string if there are none. Bullet has springs and friction of
/// its own, but by other laws, and its bridge gives exact events of frictionless impacts: with them
/// it would be another scene, so such features are refused and not approximated. [any thread]
std::string whyNotOnBullet(const Scene& scene);

/// True if at least two bodies have friction, one of them a sphere or a solid that can move. A pair
/// of which only one body has friction slides without any. [any thread]
bool hasFriction(const Scene& scene);

}  // namespace carom::scenes
