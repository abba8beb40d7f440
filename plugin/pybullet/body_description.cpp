#include "plugin/pybullet/body_description.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <utility>

#include "plugin/bullet/material_guess.h"

namespace carom::plugin {
namespace {

using Form = ContactBody::Form;

Form formOf(const b3::CollisionShape& shape) {
  switch (shape.geometry) {
    case b3::kSphere:
      return Form::sphere;
    case b3::kBox:
      return Form::box;
    case b3::kCylinder:
      return Form::cylinder;
    case b3::kCapsule:
      return Form::capsule;
    case b3::kPlane:
      return Form::plane;
    default:
      return Form::other;
  }
}

double radiusOf(const b3::CollisionShape& shape) {
  if (shape.geometry == b3::kSphere) return shape.dimensions[0];
  const bool isRound = shape.geometry == b3::kCylinder || shape.geometry == b3::kCapsule;
  return isRound ? shape.dimensions[1] : 0.0;
}

double ballVolume(double radius) {
  return 4.0 / 3.0 * std::numbers::pi * radius * radius * radius;
}

// Volume (m^3) of the solid box with that mass and inertia; 0 if there is none.
double inertiaBoxVolume(double mass, const Vec3& inertia) {
  double volume = 8.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double squared = 1.5 / mass * (inertia.sum() - 2.0 * inertia[axis]);
    volume *= std::sqrt(std::max(0.0, squared));
  }
  return volume;
}

double volumeOf(const b3::CollisionShape& shape, double boxVolume) {
  const double radius = radiusOf(shape);
  const double disc = std::numbers::pi * radius * radius;
  switch (shape.geometry) {
    case b3::kSphere:
      return ballVolume(radius);
    case b3::kBox:
      return shape.dimensions[0] * shape.dimensions[1] * shape.dimensions[2];
    case b3::kCylinder:
      return disc * shape.dimensions[0];
    case b3::kCapsule:
      return disc * shape.dimensions[0] + ballVolume(radius);
    case b3::kMesh:
      return 0.5 * boxVolume;
    default:
      return 0.0;
  }
}

double volumeOf(std::span<const b3::CollisionShape> shapes, double boxVolume) {
  if (shapes.empty()) return boxVolume;
  double volume = 0.0;
  bool hasMesh = false;  // only one counts, as the inertia is that of all meshes together
  for (const b3::CollisionShape& shape : shapes) {
    const bool isFurtherMesh = shape.geometry == b3::kMesh && std::exchange(hasMesh, true);
    volume += isFurtherMesh ? 0.0 : volumeOf(shape, boxVolume);
  }
  return volume;
}

SurfaceMesh boxSurface(const b3::CollisionShape& shape) {
  const std::array<double, 7>& frame = shape.frame;
  const Quat turn = Quat(frame[6], frame[3], frame[4], frame[5]).normalized();
  SurfaceMesh mesh;
  for (unsigned corner = 0; corner < 8; ++corner) {
    Vec3 place;
    for (unsigned axis = 0; axis < 3; ++axis)
      place[axis] = ((corner >> axis) & 1U ? 0.5 : -0.5) * shape.dimensions[axis];
    mesh.vertices.emplace_back(Vec3(frame[0], frame[1], frame[2]) + turn * place);
  }
  // Bit 0 of a corner's number is its side along x, and so on.
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

void radiateAsBox(const b3::CollisionShape& box, const Vec3& inertia, RadiatorCache& radiators,
                  SoundBody& sound) {
  const Result<RigidRadiator>& radiator = radiators.radiatorOf(boxSurface(box));
  if (!radiator) return;
  sound.shape = std::make_shared<const RigidRadiator>(*radiator);
  for (int axis = 0; axis < 3; ++axis)
    sound.inverseInertia(axis, axis) = inertia[axis] > 0.0 ? 1.0 / inertia[axis] : 0.0;
}

}  // namespace

BodyDescription describeBody(const b3::DynamicsInfo& dynamics,
                             std::span<const b3::CollisionShape> shapes, bool held, bool isLink,
                             RadiatorCache& radiators) {
  BodyDescription body;
  const bool isOne = shapes.size() == 1;
  const bool isMovable =
      dynamics.mass > 0.0 && std::isfinite(dynamics.mass) && dynamics.dynamicType == 0 && !held;
  body.contact.form = isOne ? formOf(shapes.front()) : Form::other;
  body.contact.radius = isOne ? radiusOf(shapes.front()) : 0.0;
  if (dynamics.bodyType == b3::kRigidBody) {
    body.contact.restitution = std::nullopt;
  } else {
    body.contact.restitution = dynamics.restitution;
  }
  const Vec3 inertia{dynamics.inertia[0], dynamics.inertia[1], dynamics.inertia[2]};
  const double volume =
      isMovable ? volumeOf(shapes, inertiaBoxVolume(dynamics.mass, inertia)) : 0.0;
  if (isMovable) {
    body.contact.mass = dynamics.mass;
    body.contact.inertia = inertia;
  }
  if (volume > 0.0 && std::isfinite(volume)) {
    body.sound.mass = dynamics.mass;
    body.sound.radius = std::cbrt(0.75 * volume / std::numbers::pi);
    body.sound.material = materialByDensity(dynamics.mass / volume);
    if (isOne && !isLink && body.contact.form == Form::box)
      radiateAsBox(shapes.front(), inertia, radiators, body.sound);
  } else {
    body.sound.material = *findMaterial("concrete");
  }
  body.sound.material.restitution = std::clamp(body.contact.restitution.value_or(0.5), 0.0, 1.0);
  return body;
}

}  // namespace carom::plugin
