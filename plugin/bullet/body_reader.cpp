#include "plugin/bullet/body_reader.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>
#include <btBulletDynamicsCommon.h>

#include "bullet_bridge/geometry/to_vec3.h"
#include "bullet_bridge/shapes/shape_surface.h"
#include "plugin/bullet/material_guess.h"

namespace carom::plugin {

using namespace bullet;

namespace {

double ballVolume(double radius) {
  return 4.0 / 3.0 * std::numbers::pi * radius * radius * radius;
}

// Half the volume (m^3) of the box around a shape, for shapes whose surface cannot be had; 0 for
// infinite ones.
double halfBoxVolume(const btCollisionShape& shape) {
  if (shape.isInfinite()) return 0.0;
  btVector3 low;
  btVector3 high;
  shape.getAabb(btTransform::getIdentity(), low, high);
  const btVector3 size = high - low;
  return 0.5 * static_cast<double>(size.x()) * static_cast<double>(size.y()) *
         static_cast<double>(size.z());
}

// Mass in kg; 0 if nothing that hits the body can move it.
double movableMass(const btRigidBody& rigid) {
  const bool movable = !rigid.isStaticOrKinematicObject() && rigid.getInvMass() > 0;
  return movable ? 1.0 / static_cast<double>(rigid.getInvMass()) : 0.0;
}

double movableMass(const btMultiBodyLinkCollider& collider) {
  const btMultiBody& multibody = *collider.m_multiBody;
  if (collider.isStaticOrKinematicObject()) return 0.0;
  if (collider.m_link >= 0) return static_cast<double>(multibody.getLinkMass(collider.m_link));
  return multibody.hasFixedBase() ? 0.0 : static_cast<double>(multibody.getBaseMass());
}

// Inverse inertia (1/(kg m^2), body frame) with Bullet's angular factors, which are along the
// world's axes. A body that may turn about one of them only keeps that axis, so its factor in its
// own frame stays as it is now.
Eigen::Matrix3d inverseInertiaOf(const btRigidBody& rigid) {
  const btMatrix3x3& basis = rigid.getWorldTransform().getBasis();
  Eigen::Matrix3d turn;
  for (int row = 0; row < 3; ++row)
    turn.row(row) = toVec3(basis[row]).transpose();
  return turn.transpose() * toVec3(rigid.getAngularFactor()).asDiagonal() * turn *
         toVec3(rigid.getInvInertiaDiagLocal()).asDiagonal();
}

// Heavy bodies near the listener come first; those nearer than 0.1 m are all near.
double urgencyOf(const Vec3& place, double mass, const Vec3& listener) {
  const Vec3 way = place - listener;
  return mass / std::max(way.squaredNorm(), 0.01);
}

}  // namespace

const BodyReader::Surface& BodyReader::surfaceOf(const btCollisionShape& shape, bool isSolved,
                                                 double urgency) {
  const auto [entry, isNew] = surfaces_.try_emplace(&shape);
  Surface& known = entry->second;
  const bool isAsked = isSolved && !known.id && !known.fault;
  if (!isNew && !isAsked) return known;
  Result<SurfaceMesh> surface = shapeSurface(shape);
  if (surface)
    for (Vec3& vertex : surface->vertices)
      vertex *= metres_;
  const double volume =
      surface ? signedVolume(*surface) : halfBoxVolume(shape) * metres_ * metres_ * metres_;
  known.radius = std::cbrt(volume * 0.75 / std::numbers::pi);
  if (!surface) known.fault = surface.error();
  if (surface && isSolved) known.id = solver_.request(*surface, urgency);
  return known;
}

// Reads the radius, and the radiator if the shape is solved.
void BodyReader::readShape(const btCollisionShape& shape, double urgency, BodyReading& reading) {
  SoundBody& body = reading.sound;
  if (shape.getShapeType() == SPHERE_SHAPE_PROXYTYPE) {
    body.radius =
        metres_ * static_cast<double>(static_cast<const btSphereShape&>(shape).getRadius());
    return;
  }
  const bool isSolved = choice_ == RadiatorChoice::solved && !reading.isLink;
  const Surface& surface = surfaceOf(shape, isSolved, urgency);
  body.radius = surface.radius;
  reading.unsolved = surface.fault;
  if (!isSolved || !surface.id) return;
  if (!solver_.isComplete(*surface.id)) reading.pending = surface.id;
  const auto* const radiator = solver_.solution(*surface.id);
  const auto* const recoil = solver_.recoil(*surface.id);
  if (radiator != nullptr && *radiator) body.shape = **radiator;
  if (radiator != nullptr && !*radiator) reading.unsolved = radiator->error();
  if (recoil != nullptr && *recoil) body.recoil = **recoil;
}

BodyReading BodyReader::read(const btCollisionObject& object, const Vec3& listener) {
  BodyReading reading;
  SoundBody& body = reading.sound;
  const btRigidBody* const rigid = btRigidBody::upcast(&object);
  const auto* const link = btMultiBodyLinkCollider::upcast(&object);
  const double mass = rigid != nullptr  ? movableMass(*rigid)
                      : link != nullptr ? movableMass(*link)
                                        : 0.0;
  reading.isLink = link != nullptr && mass > 0.0;
  const Vec3 place = metres_ * toVec3(object.getWorldTransform().getOrigin());
  if (mass > 0.0) readShape(*object.getCollisionShape(), urgencyOf(place, mass, listener), reading);
  const double volume = ballVolume(body.radius);
  if (volume > 0.0 && std::isfinite(volume)) {
    body.mass = mass;
    reading.density = mass / volume;
    body.material = materialByDensity(reading.density);
    if (body.shape || reading.pending)
      reading.inverseInertia = inverseInertiaOf(*rigid) / (metres_ * metres_);
    if (body.shape) body.inverseInertia = reading.inverseInertia;
  } else {
    body.material = *findMaterial("concrete");
  }
  body.material.restitution = std::clamp(static_cast<double>(object.getRestitution()), 0.0, 1.0);
  return reading;
}

}  // namespace carom::plugin
