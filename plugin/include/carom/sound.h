#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string_view>

#include <carom/audio/material.h>
#include <carom/audio/modal_model.h>
#include <carom/audio/result.h>
#include <carom/audio/surface_texture.h>
#include <carom/audio/texture_coordinates.h>
#include <carom/audio/vector.h>
#include <carom/sound_settings.h>

class btCollisionObject;
class btCollisionShape;
class btDynamicsWorld;

namespace carom {

/// Of a Bullet world, besides SoundStatistics.
struct WorldSoundStatistics : SoundStatistics {
  RadiatorCounters radiators;
  /// Pairs in contact, once per substep each, of shapes that the bridge cannot follow.
  std::uint64_t unsupportedContacts = 0;
};

/// Contact sound for a Bullet world.
///
///     auto sound = carom::Sound::attach(world);   // Result<Sound>
///     sound->play();                              // or prepareRendering and render, or record
///     ...
///     world.stepSimulation(dt);                   // as ever
///     sound->setListener(position, orientation);  // once a frame, if it moves
///     ...
///     sound->close();                             // before the world goes
///
/// Every substep of the world is followed from within; there is nothing to call for it.
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
/// `setMaterial` and at the latest `prepare`. Bodies that leave the world are forgotten; what they
/// sound then goes on.
///
/// Links of multibodies radiate as the sphere of their shape's volume, with their own mass: what
/// the joints hand on, and what they keep a link from doing, is not heard.
///
/// Threads: the one that steps the world calls everything, outside of tick callbacks, but for
/// what is said to be of another. The world must outlive the sound, or its `close`.
class Sound {
 public:
  /// Refuses what EventSound and BulletBridge refuse. Solves the shapes of the bodies that are in
  /// the world (see RadiatorChoice for how long that takes).
  static Result<Sound> attach(btDynamicsWorld& world, const SoundSettings& settings = {});
  Sound(Sound&&) noexcept;
  Sound& operator=(Sound&&) noexcept;
  /// As `close`, whose errors are lost here.
  ~Sound();

  /// Lets go of the world, stops, and finishes the recording; then everything else does nothing,
  /// and what can refuse does. What finishRecording says.
  Status close();

  /// From now on, instead of the material that was guessed, for one body; for all that have a
  /// shape; for all whose user index (btCollisionObject::getUserIndex) this is. The first of these
  /// that a body has is its own. Names are those of builtInMaterials(). A shape's is kept for its
  /// address, and a body without a user index has the index -1. Refuses objects that
  /// are not in the world, unknown names, and materials that Synth::setBody refuses.
  Status setMaterial(const btCollisionObject& object, const Material& material);
  Status setMaterial(const btCollisionObject& object, std::string_view name);
  Status setMaterial(const btCollisionShape& shape, const Material& material);
  Status setMaterial(const btCollisionShape& shape, std::string_view name);
  Status setMaterialOfUserIndex(int userIndex, const Material& material);
  Status setMaterialOfUserIndex(int userIndex, std::string_view name);

  /// From now on it rings when it is hit, with the modes of that model (see readModalModel, and
  /// carom::modal for how they are computed): likewise for one body, for all that have a shape, for
  /// all whose user index this is. One model may serve many. Null: it does not ring. A body that
  /// has no other material gets the model's.
  ///
  /// The model's axes are those of the body. A body that moves has its origin in the model's centre
  /// of mass; for one that is static or kinematic, the model is in the frame of its shape.
  Status setModes(const btCollisionObject& object, std::shared_ptr<const ModalModel> modes);
  Status setModes(const btCollisionShape& shape, std::shared_ptr<const ModalModel> modes);
  Status setModesOfUserIndex(int userIndex, std::shared_ptr<const ModalModel> modes);

  /// From now on its bumps, which sound where it slides or rolls, are those of that texture (see
  /// readNormalMap, and SurfaceTexture::rough): likewise for one body, for all that have a shape,
  /// for all whose user index this is. Null: those of its material's roughness.
  ///
  /// With the texture coordinates of its mesh, in the frame of the body, it lies as these say
  /// (TextureCoordinates::size is the size of the picture then); without, along the body's axes.
  Status setTexture(const btCollisionObject& object, std::shared_ptr<const SurfaceTexture> texture,
                    std::shared_ptr<const TextureCoordinates> coordinates = nullptr);
  Status setTexture(const btCollisionShape& shape, std::shared_ptr<const SurfaceTexture> texture,
                    std::shared_ptr<const TextureCoordinates> coordinates = nullptr);
  Status setTextureOfUserIndex(int userIndex, std::shared_ptr<const SurfaceTexture> texture,
                               std::shared_ptr<const TextureCoordinates> coordinates = nullptr);

  /// Solves the shapes of bodies that came since, so that no collision need wait for it, and takes
  /// changed masses and shapes (btCollisionShape::setLocalScaling, setCollisionShape) into account;
  /// set materials stay. For a moment when a pause does not matter.
  void prepare();

  /// As those of EventSound. The clock is the sum of all substeps since attaching.
  Status setListener(const Vec3& position, const Quat& orientation = Quat::Identity(),
                     std::size_t listener = 0);
  double time() const;
  void pause();
  Status setTimeScale(double scale);
  Status play();
  Status prepareRendering(double sampleRate);
  void stop();
  Status record(const std::filesystem::path& file);
  Status finishRecording();
  void setGain(double gain) noexcept;
  void setMuted(bool muted) noexcept;
  std::size_t channelCount() const;
  double sampleRate() const;
  std::size_t framesReady() const;
  std::size_t outputDelay() const;
  void render(std::span<float* const> channels, std::size_t frames) noexcept;
  void renderInterleaved(float* samples, std::size_t frames) noexcept;

  /// [simulation thread; EventSound's is of any]
  WorldSoundStatistics statistics() const;

 private:
  class Impl;
  explicit Sound(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace carom
