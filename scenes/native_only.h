#pragma once

#include <string>

#include "scenes/scene.h"

namespace carom::scenes {

/// Why Bullet cannot run this scene: all that is in it and that the native stepper alone can do, in
/// one sentence; empty where there is nothing of it. Bullet has springs and friction of its own,
/// but of other laws, and its bridge gives exact events of frictionless impacts: they would be
/// another scene, so they are refused and not approximated. [any thread]
std::string whyNotOnBullet(const Scene& scene);

/// Whether there are two bodies that can rub: a sphere, and another body, with friction. What has
/// friction against bodies without any slides as they do. [any thread]
bool hasFriction(const Scene& scene);

}  // namespace carom::scenes
