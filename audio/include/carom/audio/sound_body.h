#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>

#include <Eigen/Core>

#include <carom/audio/material.h>
#include <carom/audio/modal_model.h>
#include <carom/audio/result.h>
#include <carom/audio/rigid_radiator.h>
#include <carom/audio/surface_texture.h>
#include <carom/audio/texture_coordinates.h>

namespace carom {

/// The way a body radiates: as a rigid sphere, as a rigid body of any shape, or not at all (planes,
/// anything immovable), in which case it only lends its material to the contact. In addition, any
/// body may ring.
struct SoundBody {
  Material material;
  /// kg, > 0; infinite for a body that no impulse moves, which makes no acceleration noise.
  double mass = std::numeric_limits<double>::infinity();
  /// m, > 0, radius of the radiating sphere; not used where the mass is infinite or `shape` is
  /// given.
  double radius = 0.0;
  /// Bluntness of edges and corners in m, > 0: the radius of curvature where the body is hit there,
  /// and of both bodies where two flat faces meet. The default is that of a machined edge.
  double edgeRadius = 1e-3;
  /// The radiator of a body that is no sphere, about its centre of mass, in the body frame. Shared
  /// between bodies of one shape. Exact for long wavelengths; shorter ones are filtered like those
  /// of the sphere of RigidRadiator::radius, which is an approximation, unless there is `recoil`.
  std::shared_ptr<const RigidRadiator> shape = nullptr;
  /// Inverse inertia in 1/(kg m^2), body frame, about the centre of mass: decides how the body
  /// starts to turn when it is hit. Only used with `shape`; zero for a body that does not turn.
  Eigen::Matrix3d inverseInertia = Eigen::Matrix3d::Zero();
  /// The body's bumps, which sound where it slides or rolls; null: bumps of the material's
  /// roughness. The texture is projected along the axes of the body, on each side along the axis
  /// that is nearest to the side's normal, and turned onto the side; on a sphere it follows the
  /// great circles from that axis, so that it keeps its lengths.
  std::shared_ptr<const SurfaceTexture> texture = nullptr;
  /// Coordinates of `texture` on the body's mesh, in the body frame; null: the projection described
  /// at `texture`.
  std::shared_ptr<const TextureCoordinates> textureCoordinates = nullptr;
  /// The modes in which the body rings when it is hit; an immovable body may have them, too. Shared
  /// between bodies of one shape and material. The model's axes are the body's own.
  std::shared_ptr<const ModalModel> modal = nullptr;
  /// Position of the body's origin in m, model frame. Empty: the model's centre of mass.
  std::optional<Vec3> modalOrigin = std::nullopt;
  /// The recoil of a body with `shape` at every frequency and in every direction; null: as at
  /// `shape`. Impacts sound by it at listeners; what slides or rolls, and what goes into
  /// reverberation, by `shape`. Has no effect with ComparisonSettings other than their defaults.
  std::shared_ptr<const RigidRecoil> recoil = nullptr;
};

/// Refuses a material with values out of range; the message begins with the field. [any thread]
Status validate(const Material& material);

/// Refuses a body with values out of range; the message begins with the field. Does not look into
/// its modal model, which many bodies may share: validate(ModalModel) does. [any thread]
Status validate(const SoundBody& body);

}  // namespace carom
