#include "plugin/pybullet/body_description.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "plugin/bullet/material_guess.h"

namespace carom::plugin {
namespace {

using Form = ContactBody::Form;

/// For what slides, where the server does not tell it: what bodies have unless it is set.
constexpr double kUnknownRestitution = 0.0;

SurfaceMesh boxSurface(const Vec3& edges) {
  SurfaceMesh mesh;
  for (unsigned corner = 0; corner < 8; ++corner) {
    Vec3 place;
    for (unsigned axis = 0; axis < 3; ++axis)
      place[axis] = ((corner >> axis) & 1U ? 0.5 : -0.5) * edges[axis];
    mesh.vertices.push_back(place);
  }
  // Bit 0 of a corner's number is its side along x, and so on.
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

void radiateAsBox(const Vec3& edges, const Vec3& inertia, RadiatorCache& radiators,
                  SoundBody& sound) {
  const Result<RigidRadiator>& radiator = radiators.radiatorOf(boxSurface(edges));
  if (!radiator) return;
  sound.shape = std::make_shared<const RigidRadiator>(*radiator);
  for (int axis = 0; axis < 3; ++axis)
    sound.inverseInertia(axis, axis) = inertia[axis] > 0.0 ? 1.0 / inertia[axis] : 0.0;
}

}  // namespace

BodyDescription describeBody(const ShapeSigns& signs, bool held, bool isLink,
                             RadiatorCache& radiators) {
  BodyDescription body;
  const b3::DynamicsInfo& dynamics = signs.dynamics;
  const BodyShape shape = shapeOf(signs);
  const bool isMovable =
      dynamics.mass > 0.0 && std::isfinite(dynamics.mass) && dynamics.dynamicType == 0 && !held;
  body.contact.form = shape.form;
  body.contact.radius = shape.radius;
  if (dynamics.bodyType == b3::kRigidBody) {
    body.contact.restitution = std::nullopt;
  } else {
    body.contact.restitution = dynamics.restitution;
  }
  const Vec3 inertia{dynamics.inertia[0], dynamics.inertia[1], dynamics.inertia[2]};
  if (isMovable) {
    body.contact.mass = dynamics.mass;
    body.contact.inertia = inertia;
  }
  if (isMovable && shape.volume > 0.0 && std::isfinite(shape.volume)) {
    body.sound.mass = dynamics.mass;
    body.sound.radius = std::cbrt(0.75 * shape.volume / std::numbers::pi);
    body.sound.material = materialByDensity(dynamics.mass / shape.volume);
    if (!isLink && shape.form == Form::box)
      radiateAsBox(shape.edges, inertia, radiators, body.sound);
  } else {
    body.sound.material = *findMaterial("concrete");
  }
  body.sound.material.restitution =
      std::clamp(body.contact.restitution.value_or(kUnknownRestitution), 0.0, 1.0);
  return body;
}

}  // namespace carom::plugin
