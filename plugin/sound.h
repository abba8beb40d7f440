#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "audio/listener.h"
#include "audio/material.h"
#include "audio/medium.h"
#include "audio/result.h"
#include "audio/synth.h"

class btCollisionObject;
class btDynamicsWorld;

namespace carom {

struct SoundSettings {
  double sampleRate = 48000.0;  ///< Hz
  Medium medium = {};
  std::vector<Listener> listeners = {{"listener", Vec3::Zero()}};  ///< one channel each
  double restSpeed = 0.005;  ///< m/s, slower contacts are rest and make no click
  /// The impulse that follows from the motion, or the one that Bullet's solver applied, which is
  /// known one to three substeps later.
  ImpulseChoice impulse = ImpulseChoice::physical;
  /// s, how far the sound stays behind the simulation, to know every event of a block before it is
  /// rendered: the lead of the longest contact (Synth::leadTime).
  /// What comes later than that still sounds from there on, and is counted.
  double latency = 0.05;
};

/// Contact sound for a Bullet world: attach it, step the world, pull samples.
///
///     auto sound = carom::Sound::attach(world);
///     world.stepSimulation(dt);
///     std::size_t frames = sound->render(channels, room);
///
/// Every rigid body gets a material without being asked: the built-in one whose density is nearest
/// (in ratio) to the body's mass over its shape's volume, concrete for an immovable body, with the
/// restitution that the body has in Bullet. Bodies of all shapes are heard (see BulletBridge); one
/// that is not a sphere radiates as the sphere of its volume. It renders offline or from the thread
/// that steps the world; it has no device and no queue yet. [one thread]. The world must outlive
/// it.
class Sound {
 public:
  /// Refuses what BulletBridge and Synth refuse, and a latency that is negative or not finite.
  static Result<Sound> attach(btDynamicsWorld& world, const SoundSettings& settings = {});
  Sound(Sound&&) noexcept;
  Sound& operator=(Sound&&) noexcept;
  ~Sound();

  /// From now on, instead of the material that was guessed. Refuses objects that are not in the
  /// world.
  Status setMaterial(const btCollisionObject& object, const Material& material);

  /// Samples that can be rendered now: simulation time less latency, less what was rendered.
  std::size_t framesReady() const;
  /// Renders up to `room` samples of each channel, in Pa, and returns how many.
  std::size_t render(std::span<float* const> channels, std::size_t room);

  const SynthCounters& counters() const;
  /// Pairs in contact, once per substep each, of shapes that the bridge cannot follow.
  std::uint64_t unsupportedContacts() const;

 private:
  class Impl;
  explicit Sound(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace carom
