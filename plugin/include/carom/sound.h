#pragma once

#include <concepts>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include <carom/audio/material.h>
#include <carom/audio/modal_model.h>
#include <carom/audio/result.h>
#include <carom/audio/rigid_radiator.h>
#include <carom/audio/surface_texture.h>
#include <carom/audio/texture_coordinates.h>
#include <carom/audio/vector.h>
#include <carom/sound_output.h>
#include <carom/sound_settings.h>

class btCollisionObject;
class btCollisionShape;
class btDynamicsWorld;
class btQuaternion;
class btTransform;
class btVector3;

namespace carom {

/// The way in which bodies that are not spheres push the air.
enum class RadiatorChoice : std::uint8_t {
  /// By the added mass of their shape, solved once for all bodies of equal shape (panelRadiator,
  /// quick): 10 to 30 ms for a hull, up to 0.2 s for a thin, fine mesh, in a thread of its own.
  /// As the sphere of their volume until then.
  solved,
  /// As the sphere of their volume, equally in all directions: costs next to nothing. A plate is
  /// then far too quiet where it is hit flat, and too loud where it is hit on its edge.
  equivalentSphere,
};

/// The settings that only the sound of a Bullet world has, beside SoundSettings.
struct WorldSoundSettings {
  double restSpeed = 0.005;  ///< m/s, >= 0: slower contacts are rest, and make no click
  RadiatorChoice radiators = RadiatorChoice::solved;
  /// Solves how each shape recoils at every frequency and in every direction (RigidRecoil), after
  /// its added mass is solved, with RadiatorChoice::solved; recoilSolver of carom::modal does, in 3
  /// to 15 s for a shape that is not in its cache. A body clicks as the sphere of equal dipole
  /// until then, and for good where it cannot be solved, which is told. None: all bodies do.
  ///
  /// Called in the thread that solves shapes, or in a step where that has to wait, by one thread at
  /// a time. In real time a recoil takes up to 24 buses for each channel and kind of path; as many
  /// shapes are heard by theirs as half of VoiceBudget::buses suffice for, those that were solved
  /// first. That budget is raised to 1024, which are 46 MB: 10 shapes for two channels in the open.
  RecoilSolver recoil = nullptr;
  /// m, > 0: length of the world's unit, where that is not the metre. All that Sound is told and
  /// tells is in metres nevertheless, but for setListener with Bullet's own types.
  double metresPerUnit = 1.0;
};

/// A material, by the name of a built-in one (builtInMaterials) or by its numbers.
class MaterialChoice {
 public:
  // Implicit, so that `{.material = "steel"}` and `{.material = myMaterial}` read.
  MaterialChoice(const char* name);       // NOLINT(google-explicit-constructor)
  MaterialChoice(std::string_view name);  // NOLINT(google-explicit-constructor)
  MaterialChoice(std::string name);       // NOLINT(google-explicit-constructor)
  MaterialChoice(Material material);      // NOLINT(google-explicit-constructor)

  /// Returns the material. Refuses a name that is not built in, with the names that are. Does not
  /// look at the numbers. [any thread]
  Result<Material> material() const;

 private:
  std::variant<std::string, Material> choice_;
};

/// The sound of bodies, as Sound::assign sets it. A part that is not set says nothing.
///
///     {.material = "steel"}                     // a built-in material, by its name
///     {.modes = model, .texture = bumps}        // rings, and is rough where it slides
///     {.silent = true}                          // a ghost, a trigger: not heard at all
struct BodySound {
  /// Not set anywhere: the material of `modes` if the body rings, or else one that is guessed from
  /// the body's density among wood, plastic, granite and steel.
  std::optional<MaterialChoice> material = std::nullopt;

  /// The modes in which the body rings when it is hit (readModalModel; carom::modal computes them).
  /// One model may serve many bodies. Null: the body does not ring, which is also what holds if
  /// nothing is set. The model's axes are those of the body. A body that moves has its origin in
  /// the model's centre of mass; for one that is static or kinematic, the model is in the frame of
  /// its shape.
  std::optional<std::shared_ptr<const ModalModel>> modes = std::nullopt;

  /// The bumps that sound where the body slides or rolls (readNormalMap, SurfaceTexture::rough).
  /// Null: bumps of the material's roughness, which is also what holds if nothing is set.
  std::optional<std::shared_ptr<const SurfaceTexture>> texture = std::nullopt;

  /// Places of `texture` on the body's mesh, in the frame of the body; TextureCoordinates::size is
  /// the size of the picture then. Null, or not set anywhere: the texture lies along the body's
  /// axes.
  std::optional<std::shared_ptr<const TextureCoordinates>> textureCoordinates = std::nullopt;

  /// True: nothing of the body is heard, nor of what touches it, in contacts of the two: they are
  /// left out and counted (SoundStatistics::silenced). False: it is heard, whatever its shape or
  /// user index says, and also what holds if nothing is set. A body that only should not ring gets
  /// `modes = nullptr`; an immovable one does not click.
  std::optional<bool> silent = std::nullopt;
};

/// The material with which a body sounds.
struct BodyMaterial {
  Material material;
  bool isGuessed = false;  ///< from the body's density, as nothing that is assigned says otherwise
  double density = 0.0;    ///< kg/m^3, mass over the shape's volume; 0 for a body that cannot move
};

/// All bodies with that btCollisionObject::getUserIndex, as a target of Sound::assign. Bodies
/// without a user index have the index -1.
struct UserIndex {
  int value = -1;
};

/// A bound of a collision's sound at one listener.
struct HeardCollision {
  double peak = 0.0;  ///< Pa, upper bound of the clicks of both bodies; ringing is not in it
  /// dB over 20 uPa, of `peak`: 20 log10(peak / 2e-5); -infinity for 0.
  double level = -std::numeric_limits<double>::infinity();
};

/// A collision of two bodies of a Bullet world: both bodies' shares together (see ImpulseEvent).
struct SoundCollision {
  double time = 0.0;                         ///< s, clock of the simulation: first touch
  const btCollisionObject* body = nullptr;   ///< null if it is no longer in the world
  const btCollisionObject* other = nullptr;  ///< null if it is no longer in the world
  Vec3 position = Vec3::Zero();              ///< m, world frame, of the contact
  Vec3 normal = Vec3::UnitX();               ///< unit, world frame, from `other` towards `body`
  double impulse = 0.0;                      ///< N s, along the normal; see SynthSettings::impulse
  double approachSpeed = 0.0;                ///< m/s, along the normal, just before touch
  std::span<const HeardCollision> heard = {};  ///< by listener; valid during the call only
  double peak = 0.0;                           ///< Pa, the largest of `heard`
};

/// Contact sound for a Bullet world.
///
///     auto sound = carom::Sound::attach(world, {.play = true});  // Result<Sound>
///     sound->assign(ball, {.material = "steel"});                // if the guess is not right
///     world.stepSimulation(dt);                                  // as ever
///
/// Every substep of the world is followed from within; there is nothing to call for it. Outputs,
/// listeners, the clock, statistics and `close` are those of SoundOutput.
///
/// Every rigid body gets a material without being asked, by its mass over its shape's volume: wood,
/// plastic, granite or steel, whichever is nearest in density, with a stiffness between them;
/// concrete for an immovable body; with the restitution that the body has in Bullet. Bodies of all
/// shapes are heard (see BulletBridge). One that is no sphere radiates by the added mass of its
/// shape, about its centre of mass, unless RadiatorChoice says otherwise or its surface cannot be
/// solved (SoundStatistics::unsolvedBodies).
///
/// Shapes are solved once for all bodies whose surfaces are equal, whichever shape object they use,
/// in a thread of low priority that is there only as long as a shape waits: first those of bodies
/// that have sounded meanwhile, then those of the heaviest and nearest to the first listener. In
/// real time such a body sounds as a sphere until the end of the substep after its shape is solved.
/// A recording, and SoundClock::simulation, wait for the shape of each body before it first sounds,
/// so that what they give does not depend on threads (SoundStatistics::shapesSolvedInStep);
/// `prepare` waits for all. Mass, inertia, shape and scaling of a body count as they are at its
/// first collision, at its `assign` and at the latest `prepare`; a body that is released, as it was
/// static or kinematic before, or that has another mass or shape object is read again at its next
/// collision. Bodies that leave the world are forgotten; their present sound goes on.
///
/// Links of multibodies radiate as the sphere of their shape's volume, with their own mass: what
/// the joints hand on, and what they keep a link from doing, is not heard.
///
/// With no listeners set, one pair stands where a camera would: outside of the sphere around what
/// can move, from 25 degrees above, not behind what is immovable nor within a body. It glides after
/// what leaves its view, and stays for good where setListener places it.
///
/// Threads: the one that steps the world calls everything, but for the functions that are said to
/// be of another. `attach` belongs outside of steps; everything else may be called in callbacks of
/// the world as well. The world may be destroyed first: then the sound's time stands still.
class Sound : public SoundOutput {
 public:
  /// Refuses what EventSound and BulletBridge refuse, and a world that has a sound already. Where
  /// SoundSettings::play cannot be met, it attaches nevertheless. Reads the bodies that are in the
  /// world, and does not wait for their shapes.
  static Result<Sound> attach(btDynamicsWorld& world, const SoundSettings& settings = {},
                              const WorldSoundSettings& worldSettings = {});

  /// Assigns the parts that are set in `sound`, from now on, to one body, to all bodies with a
  /// shape, or to all bodies with a user index; parts that were assigned to the same target before
  /// and are not set in `sound` stay. For each part of a body, the first of these counts that says
  /// something: its own, its shape's, its user index's; then what BodySound says holds otherwise.
  ///
  /// An assignment to a body goes when the body leaves the world. A shape is known by its address,
  /// until `unassign`. A shape or user index that no body has is accepted, as such bodies may come
  /// (SoundStatistics::unusedAssignments). Refuses, and changes nothing: bodies that are not in the
  /// world, unknown names of materials, materials that Synth::setBody refuses, broken models.
  Status assign(const btCollisionObject& object, const BodySound& sound);
  Status assign(const btCollisionShape& shape, const BodySound& sound);
  Status assign(UserIndex userIndex, const BodySound& sound);

  /// Takes back all parts that were assigned to the target, which has none otherwise. Refuses
  /// bodies that are not in the world.
  Status unassign(const btCollisionObject& object);
  Status unassign(const btCollisionShape& shape);
  Status unassign(UserIndex userIndex);

  /// Solves all shapes that wait, those of bodies that were added since too, and takes changed
  /// masses and shapes (btCollisionShape::setLocalScaling, setCollisionShape) into account; what
  /// was assigned stays. To be called at a moment when a pause does not matter.
  void prepare();

  using SoundOutput::setListener;
  /// As SoundOutput::setListener, with Bullet's own types and in the world's units:
  /// btTransform, or btVector3 with an optional btQuaternion.
  template <std::same_as<btTransform> Transform>
  Status setListener(const Transform& pose, std::size_t listener = 0) {
    const auto turn = pose.getRotation();
    return placeListener(pose.getOrigin(), &turn, listener);
  }
  template <std::same_as<btVector3> Position>
  Status setListener(const Position& position, std::size_t listener = 0) {
    return placeListener(position, nullptr, listener);
  }
  template <std::same_as<btVector3> Position, std::same_as<btQuaternion> Orientation>
  Status setListener(const Position& position, const Orientation& orientation,
                     std::size_t listener = 0) {
    return placeListener(position, &orientation, listener);
  }

  /// Returns with which material a body sounds, and whether it was guessed. Refuses a body that is
  /// not in the world, or came since `attach` and has not been there for a substep.
  Result<BodyMaterial> materialOf(const btCollisionObject& object) const;

  /// Sets the function that is told of each collision that is not silenced, at the end of the
  /// substep in which its sound is decided, in order of time; null for none. It may call everything
  /// of this sound, and end it. Collisions under way are told of in `close`, unless the function
  /// itself has called it. It must not throw. Costs one more decision of each collision's loudness.
  Status onCollision(std::function<void(const SoundCollision&)> function);

 private:
  explicit Sound(std::shared_ptr<plugin::SoundSession> session);
  Status placeListener(const btVector3& position, const btQuaternion* orientation,
                       std::size_t listener);
};

}  // namespace carom
