#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "audio/limiter.h"
#include "audio/listener.h"
#include "audio/material.h"
#include "audio/pose_track.h"
#include "audio/result.h"
#include "audio/synth.h"
#include "plugin/radiator_choice.h"

class btCollisionObject;
class btDynamicsWorld;

namespace carom {

struct SoundSettings {
  /// Sample rate, medium, which impulse sounds (the one that Bullet's solver applied is known one
  /// to three substeps later), pulse, sampling, radiation, Doppler effect, room and reverberation.
  SynthSettings synth = {};
  /// Channels are those of the first, then those of the next: see ListenerFormat.
  std::vector<Listener> listeners = {{"listener", Vec3::Zero()}};
  double restSpeed = 0.005;  ///< m/s, slower contacts are rest and make no click
  /// s, how far the sound stays behind the simulation, to know every event of a block before it is
  /// rendered: the lead of the longest contact (Synth::leadTime).
  /// What comes later than that still sounds from there on, and is counted.
  double latency = 0.05;
  RadiatorChoice radiators = RadiatorChoice::solved;
  /// Pa, > 0, that come out as a sample of 1.0. None: samples are pascals.
  std::optional<double> fullScale = std::nullopt;
  /// A look-ahead limiter behind all that, for a device or a file that holds no more than its
  /// ceiling (in units of the samples that come out). It delays them by Sound::outputDelay, on top
  /// of `latency`. Its sample rate and channels are filled in. None: nothing is turned down.
  std::optional<LimiterSettings> limiter = std::nullopt;
};

/// Contact sound for a Bullet world: attach it, step the world, pull samples.
///
///     auto sound = carom::Sound::attach(world);
///     world.stepSimulation(dt);
///     sound->moveListener(0, {sound->time(), position, orientation});  // if it moves
///     std::size_t frames = sound->render(channels, room);
///
/// Every rigid body gets a material without being asked: the built-in one whose density is nearest
/// (in ratio) to the body's mass over its shape's volume, concrete for an immovable body, with the
/// restitution that the body has in Bullet. Bodies of all shapes are heard (see BulletBridge). One
/// that is no sphere radiates by the added mass of its shape, about its centre of mass, unless
/// RadiatorChoice says otherwise or its surface cannot be solved (RadiatorCounters::unsolved).
///
/// Shapes are solved in `attach`, `prepare` and `setMaterial`, and otherwise when a body that came
/// later first collides; once for all bodies whose surfaces are equal, whoever owns them. Mass,
/// inertia, shape and scaling of a body count as they are at its first collision, at its
/// `setMaterial` and at the latest `prepare`.
///
/// Links of multibodies radiate as the sphere of their shape's volume, with their own mass: what
/// the joints hand on, and what they keep a link from doing, is not heard.
///
/// It renders offline or from the thread that steps the world; it has no device and no queue yet.
/// [one thread]. The world must outlive it.
class Sound {
 public:
  /// Refuses what BulletBridge, Synth and Limiter refuse, a latency that is negative or not finite,
  /// and a full scale that is not positive or not finite. Solves the shapes of the bodies that are
  /// in the world (see RadiatorChoice for how long that takes).
  static Result<Sound> attach(btDynamicsWorld& world, const SoundSettings& settings = {});
  Sound(Sound&&) noexcept;
  Sound& operator=(Sound&&) noexcept;
  ~Sound();

  /// From now on, instead of the material that was guessed. Refuses objects that are not in the
  /// world.
  Status setMaterial(const btCollisionObject& object, const Material& material);

  /// Solves the shapes of bodies that came since, so that `render` need not, and takes changed
  /// masses and shapes (btCollisionShape::setLocalScaling, setCollisionShape) into account; set
  /// materials stay. For a moment when a pause does not matter.
  void prepare();

  /// Where a listener is from `pose.time` on, simulation clock; call it once a frame, with `time()`
  /// after the step. Refuses what Synth::moveListener refuses, among it a time that is not later
  /// than the last one: leave out frames in which the world made no substep.
  Status moveListener(std::size_t listener, const ListenerPose& pose);

  /// s, the simulation clock: sum of all substeps since attaching.
  double time() const;

  /// Of all listeners together.
  std::size_t channelCount() const;

  /// Samples that can be rendered now: simulation time less latency, less what was rendered.
  std::size_t framesReady() const;
  /// Renders up to `room` samples of each channel, in Pa or by SoundSettings::fullScale, and
  /// returns how many. Requires channels.size() == channelCount(). Sample n is what is heard at
  /// (n - outputDelay()) / sample rate on the simulation clock. First takes over what the world did
  /// since, which may allocate; the rest does not, so after a call with `room` 0 none does until
  /// the next step.
  std::size_t render(std::span<float* const> channels, std::size_t room);
  /// Frames by which the limiter delays what is rendered, its look-ahead; 0 without. To hear the
  /// end of a scene, step on for that long.
  std::size_t outputDelay() const;

  const SynthCounters& counters() const;
  RadiatorCounters radiators() const;
  /// dB, by which the limiter turned down at most; 0 without.
  double largestReduction() const;
  /// Pairs in contact, once per substep each, of shapes that the bridge cannot follow.
  std::uint64_t unsupportedContacts() const;

 private:
  class Impl;
  explicit Sound(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace carom
