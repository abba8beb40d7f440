#pragma once

#include <numbers>
#include <vector>

#include "carom/audio/listener.h"
#include "carom/audio/sound_body.h"
#include "carom/native/sphere_world.h"

namespace carom::bench {

/// The scene scenes/library/newtons_cradle.json, built with carom::native and carom::audio alone.
struct BareCradle {
  SphereWorld world;
  std::vector<SoundBody> bodies;  ///< by id
  std::vector<Listener> listeners;
  double duration = 2.0;  ///< s
};

inline BareCradle bareCradle() {
  const Material steel = *findMaterial("steel");
  BareCradle cradle;
  cradle.world.gravity = Vec3::Zero();
  cradle.world.restSpeed = 0.005;
  for (const double x : {-0.12, 0.0, 0.021, 0.042, 0.063}) {
    const auto id = static_cast<BodyId>(cradle.bodies.size());
    SoundBody body;
    body.material = steel;
    body.radius = 0.01;
    const double volume = 4.0 / 3.0 * std::numbers::pi * body.radius * body.radius * body.radius;
    body.mass = steel.density * volume;
    cradle.world.spheres.push_back(
        {.id = id,
         .radius = body.radius,
         .mass = body.mass,
         .restitution = steel.restitution,
         .position = {x, 0.0, 0.0},
         .velocity = {x < 0.0 ? 1.0 : 0.0, 0.0, 0.0},
         .stiffness = steel.youngsModulus / (1.0 - steel.poissonsRatio * steel.poissonsRatio)});
    cradle.bodies.push_back(body);
  }
  cradle.listeners = {{"listener", {0.5, 0.4, 0.3}}};
  return cradle;
}

}  // namespace carom::bench
