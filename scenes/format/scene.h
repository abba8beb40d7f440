#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "audio/propagation/pose_track.h"
#include "audio/run/host_run.h"
#include "carom/audio/impulse_event.h"
#include "carom/audio/listener.h"
#include "carom/audio/material.h"
#include "carom/audio/normal_map.h"
#include "carom/audio/synth.h"
#include "carom/modal/mesh_analysis.h"
#include "carom/native/restitution.h"
#include "carom/native/sphere_world.h"
#include "native/jello/jello_world.h"
#include "scenes/format/model_file.h"
#include "scenes/format/solid_shape.h"
#include "scenes/values/camera_key.h"

namespace carom::scenes {

struct SphereShape {
  double radius = 0.0;                  ///< m
  double mass = 0.0;                    ///< kg
  Vec3 position = Vec3::Zero();         ///< m, world frame, centre, at time 0
  Vec3 velocity = Vec3::Zero();         ///< m/s, world frame, at time 0
  Vec3 spin = Vec3::Zero();             ///< rad/s, world frame, at time 0
  Quat orientation = Quat::Identity();  ///< body to world, at time 0, for pictures; in no file
};

/// Half-space { x : normal . x <= offset } that nothing can
/// push; its normal points to the free side.
struct PlaneShape {
  Vec3 normal = Vec3::UnitY();   ///< unit
  double offset = 0.0;           ///< m, at time 0; the mean position of a plane that oscillates
  Vec3 velocity = Vec3::Zero();  ///< m/s, world frame
  Oscillation oscillation = {};
};

/// Solid box that nothing can push.
struct BlockShape {
  Vec3 centre = Vec3::Zero();           ///< m, world frame, at time 0
  Vec3 halfExtents = Vec3::Ones();      ///< m, > 0, along the block's axes
  Quat orientation = Quat::Identity();  ///< block to world, unit
  Vec3 velocity = Vec3::Zero();         ///< m/s, world frame
};

/// A lattice of springs (native/jello/jello_world.h), and how it is stepped.
struct JelloShape {
  native::JelloLattice lattice;
  native::JelloPenalty contact;
  native::JelloField field = {};
  std::vector<Vec3> positions;                        ///< m, world frame, of the points at time 0
  std::vector<Vec3> velocities;                       ///< m/s, of the points at time 0
  std::optional<native::JelloIntegrator> integrator;  ///< empty: the cheapest one for `error`
  double step = 0.0;                                  ///< s; 0: the largest one for `error`
  double error = 1e-4;                                ///< m, rms position error of the points
  std::size_t stepsPerPicture = 0;                    ///< trajectory file; 0: nearest to 1/60 s
};

/// Contact properties of a body beside those in Material.
struct ContactTraits {
  double friction = 0.0;          ///< Coulomb's coefficient, as the scene names it
  double defaultFriction = 0.0;   ///< by its material, where none is named: frictionWithSolids
  double rollingFriction = 0.0;   ///< dimensionless, of spheres, see SphereFriction::rolling
  double pivotingFriction = 0.0;  ///< m, of spheres, see SphereFriction::pivoting
  RestitutionLaw restitutionLaw = {};
};

/// The source of a body's modes.
struct Ringing {
  ModelFile model;                ///< empty: computed from the shape
  MeshAnalysisSettings analysis;  ///< settings of the computation
};

/// A normal map of a body's bumps, still to be loaded.
struct NormalMapFile {
  std::filesystem::path file;  ///< PNG that can be opened
  NormalMapSettings settings;  ///< without a size if `byCoordinates`
  bool byCoordinates = false;  ///< lies by the texture coordinates of the body's mesh
};

/// A body of a host's run, as the host has told of it. No stepper takes it, and no file names it.
struct GivenShape {
  std::shared_ptr<const audio::HostBody> body;
};

struct SceneBody {
  std::string name;  ///< unique in the scene
  Material material;
  std::variant<SphereShape, PlaneShape, BlockShape, SolidShape, std::shared_ptr<const JelloShape>,
               GivenShape>
      shape;
  SurfaceId surface = 0;  ///< its material in Scene::restitutions; 0: none there
  ContactTraits contact = {};
  std::optional<Ringing> ringing = std::nullopt;  ///< spheres and solids only
  /// If empty, the bumps are those of the material's roughness.
  std::optional<NormalMapFile> normalMap = std::nullopt;
  std::string pointer = {};  ///< JSON pointer to its entry in the file; empty if it is of no scene
};

inline bool isSolid(const SceneBody& body) {
  return std::holds_alternative<SolidShape>(body.shape);
}
inline bool isSphere(const SceneBody& body) {
  return std::holds_alternative<SphereShape>(body.shape);
}

/// The forces on the bodies besides gravity and impacts. Springs and rods refer to spheres by their
/// index in Scene::bodies.
struct SceneMechanics {
  Simultaneous simultaneous = Simultaneous::reflections;
  std::vector<Rod> rods;
  std::vector<Spring> springs;
  std::vector<ForceField> fields;
  Drag drag = {};
  double forceStep = 0.0;  ///< s, see SphereWorld::forceStep; 0: chosen for each group of spheres
};

enum class StepperType { native, bullet };

inline constexpr double kShortestStep = 1e-5;  ///< s, of Bullet's fixed step
inline constexpr double kLongestStep = 0.1;    ///< s, of Bullet's fixed step

struct StepperSettings {
  StepperType type = StepperType::native;
  double step = 1.0 / 240.0;  ///< s, Bullet's fixed step; the native stepper has none
  double restSpeed = 0.005;   ///< m/s, on either stepper: slower contacts are rest, not collisions
  bool tuned = false;         ///< applies `tune` to Bullet; with solids it always is
};

/// The way in which a body that is no sphere recoils in the air from an impact.
enum class RecoilModel {
  sphere,  ///< as the sphere of equal dipole: exact for long waves
  shape,   ///< by its own shape at every frequency (RigidRecoil), solved once
};

/// The path of a listener. At time 0 and before, the listener stands as Scene::listeners has it.
struct ListenerPath {
  std::size_t listener = 0;         ///< index in Scene::listeners
  std::vector<ListenerPose> poses;  ///< times above 0, ascending; it stays at the last one
};

/// The responses of a binaural listener's head, still to be loaded.
struct HeadFile {
  std::size_t listener = 0;  ///< index in Scene::listeners
  std::filesystem::path sofa;
};

/// A complete scene: boxes and groups are expanded, every value is checked. A body's index here is
/// its BodyId on either stepper. There is at most one jello.
struct Scene {
  std::string name;
  std::string description;
  std::vector<std::filesystem::path> files;  ///< that it names: meshes, pictures, heads, models
  double duration = 0.0;                     ///< s
  double sampleRate = 48000.0;               ///< Hz
  Vec3 gravity = {0.0, -9.81, 0.0};          ///< m/s^2
  Medium medium;
  StepperSettings stepper;
  SynthSettings sound;  ///< with the room; its sample rate and medium are not used
  RecoilModel recoil = RecoilModel::shape;
  std::vector<SceneBody> bodies;
  RestitutionTable restitutions;  ///< restitutions of certain pairs of materials
  SceneMechanics mechanics;
  std::vector<Listener> listeners;
  std::vector<ListenerPath> paths;       ///< paths of listeners that move, at most one for each
  std::vector<HeadFile> headFiles;       ///< heads of binaural listeners that name one
  std::vector<CameraKey> camera;         ///< key frames for a film; empty: it has a view of its own
  std::optional<std::size_t> mostModes;  ///< most modes of a body, its lowest; empty: all
};

/// Returns the scene's jello, or null. [any thread]
inline const JelloShape* jelloOf(const Scene& scene) {
  for (const SceneBody& body : scene.bodies)
    if (const auto* jello = std::get_if<std::shared_ptr<const JelloShape>>(&body.shape))
      return jello->get();
  return nullptr;
}

/// Returns the body's own coefficient of friction in a contact with a solid: the one that the scene
/// names, or else its material's. Among spheres, planes and blocks only the named one counts, and
/// so it does for a sphere on a solid: spheres are as on the native stepper. A pair has the
/// geometric mean of both bodies' own. [any thread]
inline double frictionWithSolids(const SceneBody& body) {
  const ContactTraits& contact = body.contact;
  if (isSphere(body) || contact.friction > 0.0) return contact.friction;
  return contact.defaultFriction;
}

/// Returns the coefficient of restitution of two bodies of the scene: the one that the scene gives
/// for their materials, or the geometric mean. [any thread]
inline double restitutionOf(const Scene& scene, const SceneBody& body, const SceneBody& other) {
  return scene.restitutions.of(body.surface, body.material.restitution, other.surface,
                               other.material.restitution);
}

}  // namespace carom::scenes
