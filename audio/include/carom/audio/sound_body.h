#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>

#include <Eigen/Core>

#include <carom/audio/material.h>
#include <carom/audio/modal_model.h>
#include <carom/audio/rigid_radiator.h>
#include <carom/audio/surface_texture.h>
#include <carom/audio/texture_coordinates.h>

namespace carom {

/// What a body radiates as: a rigid sphere, a rigid body of any shape, or nothing at all (planes,
/// anything immovable), in which case it only lends its material to the contact. Beside that, any
/// body may ring.
struct SoundBody {
  Material material;
  /// kg, > 0; infinite for a body that no impulse moves, which makes no acceleration noise.
  double mass = std::numeric_limits<double>::infinity();
  /// m, > 0, radius of the radiating sphere; not used where the mass is infinite or `shape` is
  /// given.
  double radius = 0.0;
  /// m, > 0, how blunt its edges and corners are: the radius of curvature where it is hit there,
  /// and of both bodies where two flat faces meet. The default is that of a machined edge.
  double edgeRadius = 1e-3;
  /// How a body that is no sphere pushes the air, about its centre of mass, in its own frame.
  /// Shared between bodies of one shape. Exact for long wavelengths; above them it is filtered
  /// like the sphere of RigidRadiator::radius, which is an approximation.
  std::shared_ptr<const RigidRadiator> shape = nullptr;
  /// 1/(kg m^2), body frame, about the centre of mass: how it starts to turn when it is hit. Only
  /// used with `shape`; zero for a body that does not turn.
  Eigen::Matrix3d inverseInertia = Eigen::Matrix3d::Zero();
  /// Its bumps, which sound where it slides or rolls; null: those of its material's roughness. Laid
  /// on it along the axes of the body, on each side along the axis that is nearest to the side's
  /// normal, and turned onto the side; on a sphere along its great circles from there, so that it
  /// keeps its lengths.
  std::shared_ptr<const SurfaceTexture> texture = nullptr;
  /// How `texture` lies on its mesh, in the frame of the body, if not as just said.
  std::shared_ptr<const TextureCoordinates> textureCoordinates = nullptr;
  /// How it rings when it is hit; also of a body that nothing moves. Shared between bodies of one
  /// shape and material. Its axes are the body's own.
  std::shared_ptr<const ModalModel> modal = nullptr;
  /// m, model frame: where the body's own origin is. Empty: in the model's centre of mass.
  std::optional<Vec3> modalOrigin = std::nullopt;
};

/// Why a material cannot be used: one sentence, or nothing when it can be. [any thread]
std::string whyNot(const Material& material);

/// Why a body cannot be used: one sentence that begins with the field, or nothing when it can be.
/// Does not look into its modal model, which many bodies may share: whyNot(ModalModel) does.
/// [any thread]
std::string whyNot(const SoundBody& body);

}  // namespace carom
