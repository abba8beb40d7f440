#pragma once

#include "carom/audio/vector.h"

namespace carom::native {

/// The rotation of a homogeneous sphere: its spin and the change of its spin, which is constant
/// between two changes of its motion. Internal to native/.
struct Spin {
  Vec3 velocity = Vec3::Zero();      ///< rad/s, world frame, at the `since` of its Motion
  Vec3 acceleration = Vec3::Zero();  ///< rad/s^2
};

/// Two bodies at a point of contact; an immovable one has an inverseMass of 0.
struct FrictionContact {
  Vec3 normal;                   ///< unit, towards the first body
  Vec3 velocity = Vec3::Zero();  ///< m/s, relative to the second body, before the impact
  Vec3 spin = Vec3::Zero();      ///< rad/s, of the first body; then its radius (m) and 1/kg
  double radius = 0.0;
  double inverseMass = 0.0;
  Vec3 otherSpin = Vec3::Zero();  ///< the same for the second body
  double otherRadius = 0.0;
  double otherInverseMass = 0.0;
  double friction = 0.0;  ///< 1, Coulomb's
};

/// Returns the impulse of friction (N s, on the first body) in an impact that pushes with `impulse`
/// N s along the normal. It acts against the slip of the surfaces, whose direction does not change
/// in the impact of spheres, and ends the slip if it can: it is the lesser of friction * impulse
/// and the impulse that stops the slip. Then the surfaces stick (no tangential restitution). Exact
/// for Coulomb's law with rigid spheres, as the normal and the tangential motion do not mix (Walton
/// 1993). [any thread]
Vec3 frictionImpulse(const FrictionContact& contact, double impulse);

/// Returns the change (rad/s) of a homogeneous sphere's spin by `impulse` N s that acts at `arm` m
/// from its centre. [any thread]
Vec3 spinChange(const Vec3& arm, const Vec3& impulse, double mass, double radius);

/// A sphere that a plane holds.
struct RollingContact {
  Vec3 normal;            ///< unit, towards the sphere
  double radius = 0.0;    ///< m
  double support = 0.0;   ///< m/s^2, >= 0, the plane's push along the normal, per mass
  Vec3 pull;              ///< m/s^2, by other forces, along the plane
  double sliding = 0.0;   ///< 1, Coulomb's friction
  double rolling = 0.0;   ///< 1, see SphereFriction
  double pivoting = 0.0;  ///< m, see SphereFriction
};

/// The next course of the sphere and its duration.
struct RollingCourse {
  Vec3 velocity;      ///< m/s, relative to the plane; slip within rounding is removed
  Vec3 acceleration;  ///< m/s^2
  Spin spin;
  double duration = 0.0;  ///< s, infinite if for ever
};

/// Returns the next course of a sphere on a plane: sliding, rolling, pivoting or still. It is exact
/// on a level plane, and wherever the pull is along the slip or the path: sliding friction has the
/// slip's direction, which is constant there, and the slip falls by 7/2 of the sphere's slowing (a
/// homogeneous sphere has I = 2/5 m r^2); the sphere rolls from the point where the slip is zero,
/// with 5/7 of the pull if friction can give 2/7 of it, less rolling resistance. On a slope that
/// is crossed at an angle the directions turn: there the course holds for a time in which they turn
/// by kTurn at most, and is of second order in it. `velocity` is relative to the plane, along it.
/// [any thread]
RollingCourse rollingCourse(const RollingContact& contact, const Vec3& velocity, const Vec3& spin);

}  // namespace carom::native
