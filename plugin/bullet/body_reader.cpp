#include "plugin/bullet/body_reader.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

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

}  // namespace

Result<BodyReader::Radiator> BodyReader::solve(const SurfaceMesh& surface) {
  const Result<RigidRadiator>& found = cache_->radiatorOf(surface);
  if (!found) return found.error();
  solved_.insert(&*found);
  return Radiator(cache_, &*found);
}

// Reads the radius, and the radiator if the shape can be solved.
void BodyReader::readShape(const btCollisionShape& shape, BodyReading& reading) {
  SoundBody& body = reading.sound;
  if (shape.getShapeType() == SPHERE_SHAPE_PROXYTYPE) {
    body.radius = static_cast<double>(static_cast<const btSphereShape&>(shape).getRadius());
    return;
  }
  const Result<SurfaceMesh> surface = shapeSurface(shape);
  const double volume = surface ? signedVolume(*surface) : halfBoxVolume(shape);
  body.radius = std::cbrt(volume * 0.75 / std::numbers::pi);
  if (!surface) {
    reading.unsolved = surface.error();
  } else if (choice_ == RadiatorChoice::solved && !reading.isLink) {
    const Result<Radiator> radiator = solve(*surface);
    if (radiator)
      body.shape = *radiator;
    else
      reading.unsolved = radiator.error();
  }
}

BodyReading BodyReader::read(const btCollisionObject& object) {
  BodyReading reading;
  SoundBody& body = reading.sound;
  const btRigidBody* const rigid = btRigidBody::upcast(&object);
  const auto* const link = btMultiBodyLinkCollider::upcast(&object);
  const double mass = rigid != nullptr  ? movableMass(*rigid)
                      : link != nullptr ? movableMass(*link)
                                        : 0.0;
  reading.isLink = link != nullptr && mass > 0.0;
  if (mass > 0.0) readShape(*object.getCollisionShape(), reading);
  const double volume = ballVolume(body.radius);
  if (volume > 0.0 && std::isfinite(volume)) {
    body.mass = mass;
    body.material = materialByDensity(mass / volume);
    if (body.shape) body.inverseInertia = inverseInertiaOf(*rigid);
  } else {
    body.material = *findMaterial("concrete");
  }
  body.material.restitution = std::clamp(static_cast<double>(object.getRestitution()), 0.0, 1.0);
  return reading;
}

}  // namespace carom::plugin
