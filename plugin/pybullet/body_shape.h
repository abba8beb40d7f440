#pragma once

#include <optional>

#include "carom/audio/vector.h"
#include "plugin/pybullet/contact_impact.h"
#include "plugin/pybullet/server_abi.h"

namespace carom::plugin {

/// The shape of a body, as far as it can be told.
struct BodyShape {
  ContactBody::Form form = ContactBody::Form::other;
  /// m: edges of the box around it, in the axes of its inertia; 0 if nothing is known.
  Vec3 edges = Vec3::Zero();
  double radius = 0.0;  ///< m: of a sphere, of a cylinder and of a capsule along z
  double volume = 0.0;  ///< m^3; 0 for what does not move, or has none
};

/// The answers of the server from which a shape is found: it gives them of any body, without
/// danger.
struct ShapeSigns {
  b3::DynamicsInfo dynamics{};
  Quat orientation = Quat::Identity();  ///< axes of inertia to world
  /// m, half the edges of the box around it in world axes
  std::optional<Vec3> halfBounds = std::nullopt;
};

/// Finds the shape that has this mass, inertia, margin and bounds. Bullet gives each kind of shape
/// its own: a sphere's margin is its radius, as a capsule's; the inertia is that of the shape, of a
/// capsule that of the box around it; and the box around it, in world axes, follows from its
/// orientation. All must agree within 3 parts in 10,000. Of what does not move, spheres and planes
/// are told from the rest. Everything else is of form `other`: hulls, meshes, sets of spheres; it
/// fills half of the box that has its inertia, as meshes and people do more or less. Compounds, to
/// which Bullet gives the inertia of the box around them, are taken for boxes. [any thread]
BodyShape shapeOf(const ShapeSigns& signs);

}  // namespace carom::plugin
