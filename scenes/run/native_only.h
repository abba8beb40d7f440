#pragma once

#include "carom/audio/result.h"
#include "scenes/format/scene.h"

namespace carom::scenes {

/// Refuses a scene that Bullet cannot run, in one sentence that lists all features in it that only
/// the native stepper has. Bullet has springs and friction of
/// its own, but by other laws, and its bridge gives exact events of frictionless impacts: with them
/// it would be another scene, so such features are refused and not approximated. [any thread]
Status validateForBullet(const Scene& scene);

/// True if at least two bodies have friction, one of them a sphere or a solid that can move. A pair
/// of which only one body has friction slides without any. [any thread]
bool hasFriction(const Scene& scene);

}  // namespace carom::scenes
