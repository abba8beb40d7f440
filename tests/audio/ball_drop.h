#pragma once

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "carom/audio/impulse_event.h"
#include "carom/audio/material.h"
#include "carom/audio/synth.h"

namespace carom::test {

inline constexpr BodyId kBall = 1;
inline constexpr BodyId kFloor = 2;

/// A ball of a built-in material that falls on an immovable floor of the same material, without
/// loss.
struct BallDrop {
  Material material = *findMaterial("steel");
  double radius = 0.01;  // m
  double speed = 1.0;    // m/s
  double time = 0.0;     // s
  Vec3 centre = Vec3::Zero();

  double mass() const {
    return 4.0 / 3.0 * std::numbers::pi * radius * radius * radius * material.density;
  }
  SoundBody ball() const { return {.material = material, .mass = mass(), .radius = radius}; }
  SoundBody floor() const { return {.material = material}; }

  ImpulseEvent event() const {
    ImpulseEvent event;
    event.time = time;
    event.body = kBall;
    event.other = kFloor;
    event.normal = Vec3::UnitZ();
    event.impulse = 2.0 * mass() * speed * Vec3::UnitZ();
    event.approachSpeed = speed;
    event.effectiveMass = mass();
    event.radius = radius;
    event.bodyPosition = centre;
    event.position = centre - radius * Vec3::UnitZ();
    event.bodyVelocity = -speed * Vec3::UnitZ();
    return event;
  }
};

/// Returns a synth that knows the ball and the floor of `drop`.
inline Synth makeSynth(const BallDrop& drop, std::vector<Listener> listeners,
                       const SynthSettings& settings = {}) {
  Synth synth = *Synth::create(settings, std::move(listeners));
  if (!synth.setBody(kBall, drop.ball()) || !synth.setBody(kFloor, drop.floor())) std::abort();
  return synth;
}

/// Returns the first listener's next `frames` samples.
template <class Sample = double>
std::vector<Sample> renderMono(Synth& synth, std::size_t frames) {
  std::vector<std::vector<Sample>> planes(synth.listeners().size(), std::vector<Sample>(frames));
  std::vector<Sample*> channels;
  channels.reserve(planes.size());
  for (std::vector<Sample>& plane : planes)
    channels.push_back(plane.data());
  synth.render<Sample>(channels, frames);
  return planes.front();
}

/// Returns the next `frames` samples of every channel.
template <class Sample = double>
std::vector<std::vector<Sample>> renderPlanes(Synth& synth, std::size_t frames) {
  std::vector<std::vector<Sample>> planes(synth.channelCount(), std::vector<Sample>(frames));
  std::vector<Sample*> channels;
  channels.reserve(planes.size());
  for (std::vector<Sample>& plane : planes)
    channels.push_back(plane.data());
  synth.render<Sample>(channels, frames);
  return planes;
}

inline double peakOf(const std::vector<double>& samples) {
  double peak = 0.0;
  for (const double sample : samples)
    peak = std::max(peak, std::abs(sample));
  return peak;
}

}  // namespace carom::test
