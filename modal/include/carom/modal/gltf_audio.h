#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include <carom/audio/modal_model.h>
#include <carom/audio/result.h>
#include <carom/audio/vector.h>

namespace carom {

// The content of the extension KHR_audio_rigid_bodies of a glTF 2.0 file, field by field. The
// extension is a draft by K. Hiner: https://github.com/khiner/MeshEditor, folder
// glTF_PhysicalAudio, as of commit 806d6e34471fbc8f749eb26c064606d9e44dcb91 of 16 August 2026,
// README.md and the JSON schemas beside it. docs/model_file.md says how its data are used.
//
// Units are SI. "Local" is the frame of the node that a model is attached to, before its scale.

/// The material of a solid. A field that is absent is not known.
struct GltfAcousticMaterial {
  std::string name;
  std::optional<double> density;        ///< kg/m^3
  std::optional<double> youngsModulus;  ///< Pa
  std::optional<double> poissonRatio;   ///< 1, in (-1, 0.5)
  std::optional<double> alpha;          ///< 1/s, Rayleigh damping; see Material
  std::optional<double> beta;           ///< s
  std::optional<double> restitution;    ///< 1; not of the draft: extras/carom/restitution
};

/// The finish of a surface, below the scale of its mesh. Lengths do not scale with the node. The
/// draft calls this part unsettled.
struct GltfAcousticSurface {
  std::string name;
  double roughness = 2e-6;          ///< m, rms height
  double correlationLength = 5e-5;  ///< m, between asperities
  double spectralSlope = -2.4;      ///< slope of the power spectrum over spatial frequency, <= 0
  std::optional<double> shortWavelength;  ///< m, where the spectrum ends; correlationLength / 16
  double waviness = 2e-6;                 ///< m, rms departure from flat above the finish
  double wavinessLength = 2e-3;           ///< m, lateral extent of the waviness
  std::vector<float> profile;             ///< m, measured heights along a track, 2 or more; or none
  double sampleSpacing = 0.0;             ///< m, between the heights
  /// Texture of the normal map, in the file that was read. It is not written: the texture is not
  /// here.
  std::optional<std::size_t> normalTexture;
  std::size_t normalTexCoord = 0;
  double normalScale = 1.0;
  std::optional<std::size_t> material;  ///< index into GltfAudio::materials
};

/// The distribution of a body's mass.
struct GltfMassProperties {
  double mass = 0.0;                        ///< kg
  Vec3 centreOfMass = Vec3::Zero();         ///< local
  Vec3 inertiaDiagonal = Vec3::Zero();      ///< kg m^2, principal moments; 0: a point
  Quat inertiaOrientation{1., 0., 0., 0.};  ///< turns the principal axes into the local frame
};

/// The modes of a body, at points of its surface.
struct GltfModalModel {
  std::string name;
  std::vector<float> frequencies;          ///< Hz, as heard: damped; in any order
  std::vector<float> decayRates;           ///< 1/s, of the amplitude
  std::vector<Eigen::Vector3f> positions;  ///< local
  std::vector<Eigen::Vector3f> shapes;     ///< 1/sqrt(kg), mode by mode, one for each position
  std::vector<std::uint32_t> indices;      ///< three for each triangle of positions; or none
  std::optional<std::size_t> material;     ///< index into GltfAudio::materials
  std::optional<GltfMassProperties> massProperties;
  /// ModeRadiation::volume of each mode, or none at all; not of the draft, but extras/carom.
  std::vector<double> volumes;
  std::optional<ModesLeftOut> leftOut;  ///< not of the draft either
};

/// A node that sounds, or has a surface on which others sound, or both.
struct GltfAudioNode {
  std::string name;
  std::optional<std::size_t> modalModel;       ///< index into GltfAudio::models
  std::optional<std::size_t> acousticSurface;  ///< index into GltfAudio::surfaces
  double gain = 1.0;                           ///< gain of its sound
  Mat4 globalTransform = Mat4::Identity();     ///< m, local to the scene's frame
};

struct GltfAudio {
  std::vector<GltfModalModel> models;
  std::vector<GltfAcousticMaterial> materials;
  std::vector<GltfAcousticSurface> surfaces;
  std::vector<GltfAudioNode> nodes;  ///< nodes of the file that use the extension
};

/// Refuses what the draft does not allow; the message begins with a JSON pointer within the
/// extension. [any thread]
Status validate(const GltfAudio& audio);

/// Reads .gltf (buffers as base64 in the file, or in files below its folder) and .glb, told apart
/// by their first bytes. Everything else in the file is passed over: meshes, textures, other
/// extensions. An error has the JSON pointer of the fault. Refused besides data that the draft
/// refuses: sparse accessors, accessors without a buffer view, and more than 1 GiB in all.
/// [any thread; blocks on the disk]
Result<GltfAudio> readGltfAudio(const std::filesystem::path& path);

/// Reads the same from bytes, which messages call `name`. `folder` has the files of external
/// buffers; none are read if it is empty. [any thread]
Result<GltfAudio> parseGltfAudio(std::span<const std::byte> bytes, std::string_view name,
                                 const std::filesystem::path& folder = {});

/// Writes a file with this content and nothing else, .glb or .gltf (with base64) by the extension
/// of `path`; it appears whole or not at all. Refuses data that the draft does not allow.
/// [any thread; blocks on the disk]
Status writeGltfAudio(const std::filesystem::path& path, const GltfAudio& audio);

/// Adds the model, its material and a node that has both, as far as the draft can hold them:
/// frequencies become those that are heard, sqrt(omega^2 - d^2) / (2 pi), and they, the vertices
/// and all else in accessors become floats. A fault shows as validate(GltfAudio), such as a model
/// without modes. Data for which the draft has no place go into `extras`: restitution, the modes
/// that were left out, and each mode's volume. ModeRadiation::multipoles and the medium that they
/// are computed for do not go along. [any thread]
void addModalModel(GltfAudio& audio, const ModalModel& model);

/// Converts the model into one that can be sounded; `audio` is as readGltfAudio gives it.
///
/// - `scale` is that of the node, which takes positions to metres: uniformScale(node). Modes are
///   those of the body as it stands in the scene, so nothing else changes.
/// - Frequencies become those without damping; modes outside of the audible band, and those that do
///   not oscillate, are left out and counted; the others are in ascending order.
/// - Properties that the material lacks, or all if there is no material, come from `fallback`; so
///   does the restitution, unless it is in the extras.
/// - Without massProperties, mass and centre of mass follow from the density and the closed surface
///   of `indices`; the moments of inertia are 0 then. It is an error if the surface is not closed.
/// - Multipoles are empty, volumes 0 unless in the extras, the medium is the default one.
///
/// [any thread]
Result<ModalModel> toModalModel(const GltfAudio& audio, std::size_t model, double scale,
                                const Material& fallback);

/// Returns the one factor by which a node scales in all directions; an error if there is none, for
/// modes cannot follow then. [any thread]
Result<double> uniformScale(const GltfAudioNode& node);

}  // namespace carom
