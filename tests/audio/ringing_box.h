#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "carom/audio/impulse_event.h"
#include "carom/audio/modal_model.h"
#include "tests/audio/ball_drop.h"
#include "tests/audio/meshes.h"

namespace carom::test {

struct Tone {
  double frequency = 1000.0;  // Hz
  double decayRate = 20.0;    // 1/s
  double volume = 1e-3;       // m^2 / sqrt(kg)
};

/// A box whose vertices all move along one direction in every mode: only the force along it counts.
inline std::shared_ptr<const ModalModel> boxOf(const std::vector<Tone>& tones,
                                               const Vec3& along = Vec3::UnitZ()) {
  ModalModel model;
  model.name = "box";
  model.material = *findMaterial("steel");
  model.mass = 0.04;
  model.inertia.setIdentity();
  model.surface = boxMesh({0.01, 0.01, 0.01});
  for (const Tone& tone : tones) {
    Mode mode;
    mode.frequency = tone.frequency;
    mode.decayRate = tone.decayRate;
    mode.radiation.volume = tone.volume;
    model.modes.push_back(mode);
    for (std::size_t vertex = 0; vertex < model.surface.vertices.size(); ++vertex)
      for (const double component : along)
        model.shapes.push_back(static_cast<float>(5.0 * component));
  }
  return std::make_shared<const ModalModel>(std::move(model));
}

/// A ball that falls on the box, whose centre is the world's origin.
inline BallDrop dropOnBox(double time) {
  BallDrop drop;
  drop.radius = 0.005;
  drop.time = time;
  drop.centre = {0.0, 0.0, 0.015};
  return drop;
}

/// The box's share of the impact, as the floor.
inline ImpulseEvent floorShare(const BallDrop& drop) {
  ImpulseEvent event = drop.event();
  std::swap(event.body, event.other);
  event.impulse = -event.impulse;
  event.normal = -event.normal;
  event.otherRadius = std::exchange(event.radius, event.otherRadius);
  event.bodyPosition = Vec3::Zero();
  event.bodyVelocity = Vec3::Zero();
  return event;
}

}  // namespace carom::test
