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

/// Statistics of the sound of a Bullet world.
struct WorldSoundStatistics : SoundStatistics {
  RadiatorCounters radiators;
  /// Pairs in contact whose shapes the bridge cannot follow, counted once per substep each.
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
/// later first collides; once for all bodies whose surfaces are equal, whichever shape object they
/// use. Mass, inertia, shape and scaling of a body count as they are at its first collision, at its
/// `setMaterial` and at the latest `prepare`. Bodies that leave the world are forgotten; their
/// present sound goes on.
///
/// Links of multibodies radiate as the sphere of their shape's volume, with their own mass: what
/// the joints hand on, and what they keep a link from doing, is not heard.
///
/// Threads: the one that steps the world calls everything, outside of tick callbacks, but for the
/// functions that are said to be of another. The world must outlive the sound, or its `close`.
class Sound {
 public:
  /// Refuses what EventSound and BulletBridge refuse. Solves the shapes of the bodies that are in
  /// the world (see RadiatorChoice for how long that takes).
  static Result<Sound> attach(btDynamicsWorld& world, const SoundSettings& settings = {});
  Sound(Sound&&) noexcept;
  Sound& operator=(Sound&&) noexcept;
  /// Closes the sound; the errors of `close` are lost here.
  ~Sound();

  /// Detaches from the world, stops, and finishes the recording. Afterwards all other functions do
  /// nothing, and those that can refuse do. Returns the errors of finishRecording.
  Status close();

  /// Sets a material, from now on and instead of the guessed one: for one body, for all bodies with
  /// a shape, or for all bodies with a user index (btCollisionObject::getUserIndex). In this order,
  /// the first that is set counts for a body. Names are those of builtInMaterials(). A shape's
  /// material is kept for its address, and a body without a user index has the index -1. Refuses
  /// objects that are not in the world, unknown names, and materials that Synth::setBody refuses.
  Status setMaterial(const btCollisionObject& object, const Material& material);
  Status setMaterial(const btCollisionObject& object, std::string_view name);
  Status setMaterial(const btCollisionShape& shape, const Material& material);
  Status setMaterial(const btCollisionShape& shape, std::string_view name);
  Status setMaterialOfUserIndex(int userIndex, const Material& material);
  Status setMaterialOfUserIndex(int userIndex, std::string_view name);

  /// Makes bodies ring when they are hit, from now on, with the modes of a model (see
  /// readModalModel, and carom::modal for how they are computed): for one body, for all bodies with
  /// a shape, or for all bodies with a user index, as in setMaterial. One model may serve many.
  /// Null: they do not ring. A body that has no other material gets the model's.
  ///
  /// The model's axes are those of the body. A body that moves has its origin in the model's centre
  /// of mass; for one that is static or kinematic, the model is in the frame of its shape.
  Status setModes(const btCollisionObject& object, std::shared_ptr<const ModalModel> modes);
  Status setModes(const btCollisionShape& shape, std::shared_ptr<const ModalModel> modes);
  Status setModesOfUserIndex(int userIndex, std::shared_ptr<const ModalModel> modes);

  /// Sets the texture of the bumps, which sound where a body slides or rolls, from now on (see
  /// readNormalMap, and SurfaceTexture::rough): for one body, for all bodies with a shape, or for
  /// all bodies with a user index, as in setMaterial. Null: the bumps of the material's roughness.
  ///
  /// With the texture coordinates of the body's mesh, in the frame of the body, the texture lies as
  /// these say (TextureCoordinates::size is the size of the picture then); without, along the
  /// body's axes.
  Status setTexture(const btCollisionObject& object, std::shared_ptr<const SurfaceTexture> texture,
                    std::shared_ptr<const TextureCoordinates> coordinates = nullptr);
  Status setTexture(const btCollisionShape& shape, std::shared_ptr<const SurfaceTexture> texture,
                    std::shared_ptr<const TextureCoordinates> coordinates = nullptr);
  Status setTextureOfUserIndex(int userIndex, std::shared_ptr<const SurfaceTexture> texture,
                               std::shared_ptr<const TextureCoordinates> coordinates = nullptr);

  /// Solves the shapes of bodies that were added since, so that no collision need wait for it, and
  /// takes changed masses and shapes (btCollisionShape::setLocalScaling, setCollisionShape) into
  /// account; set materials stay. To be called at a moment when a pause does not matter.
  void prepare();

  /// These functions are those of EventSound. The clock is the sum of all substeps since attaching.
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

  /// [simulation thread]
  WorldSoundStatistics statistics() const;

 private:
  class Impl;
  explicit Sound(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace carom
