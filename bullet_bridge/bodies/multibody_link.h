#pragma once

#include <cstddef>
#include <vector>

#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include "carom/audio/vector.h"

namespace carom::bullet {

struct LinkVelocity {
  Vec3 linear = Vec3::Zero();   ///< m/s, world frame, of the link's centre of mass
  Vec3 angular = Vec3::Zero();  ///< rad/s, world frame
};

/// Velocity of a link of a Bullet multibody (or of its base), at the pose and the joint velocities
/// that the multibody has now. Bullet puts the collider's origin at the centre of mass.
///
/// The pose is the multibody's own. A host that sets joints by hand has to call Bullet's
/// forwardKinematics and updateCollisionObjectWorldTransforms to bring the colliders along.
/// [physics thread]
LinkVelocity linkVelocity(const btMultiBodyLinkCollider& link);

/// The response of a Bullet multibody to an impulse at a point of one of its links: its joints pull
/// the other links along.
///
/// inverseEffectiveMass is n . J M^-1 J^T n in 1/kg: the change of the point's velocity along the
/// direction n that a unit impulse there along n makes. M is the joint space mass matrix, summed
/// from composite inertias and factored along the tree (R. Featherstone, "Rigid Body Dynamics
/// Algorithms", 2008, tables 6.2 and 6.3), in double, at the pose that the multibody has now.
///
/// Bullet's own calcAccelerationDeltasMultiDof is not used: it works with what the last solve left
/// behind, so its mass matrix belongs to the pose at the start of the substep and its Jacobian to
/// the current one, and before the first step there is none.
///
/// As in Bullet, a static or kinematic base does not move, nor do links that are kinematic like all
/// their ancestors; joints are free, so motors, limits, springs, friction and constraints between
/// multibodies are not felt. Where Bullet's float build locks joints with an inertia below 1.2e-7
/// (kg m^2, or kg), this class does not; a joint that moves no mass at all is locked.
///
/// Keeps its memory: no allocation once it has seen the largest multibody. [physics thread]
class MultibodyMass {
 public:
  /// Inverse effective mass (1/kg) at `point` (m, world frame) along `direction` (unit, world
  /// frame); 0 if the link cannot move that way.
  double inverseEffectiveMass(const btMultiBodyLinkCollider& link, const Vec3& point,
                              const Vec3& direction);
  /// Inverse effective mass (1/kg) for the relative velocity of two links, of one multibody or of
  /// two, under equal and opposite impulses. The points are those of the contact on each.
  double inverseEffectiveMass(const btMultiBodyLinkCollider& first, const Vec3& firstPoint,
                              const btMultiBodyLinkCollider& second, const Vec3& secondPoint,
                              const Vec3& direction);

 private:
  // Motion of a rigid body: angular velocity, and velocity of the point of it that is at the
  // reference, the multibody's base.
  struct Twist {
    Vec3 angular;
    Vec3 linear;
  };
  struct Inertia {
    double mass;             // kg
    Vec3 moment;             // kg m, mass times place
    Eigen::Matrix3d second;  // kg m^2, about the reference
  };
  struct Link {
    int parent;                // index into links_, -1 for the base
    int lastDof;               // the nearest degree of freedom that moves this link, or -1
    Eigen::Matrix3d rotation;  // link to world
    Vec3 centre;               // m, centre of mass, from the reference
    Inertia composite;         // inertia of the link and all that hangs on it
  };
  struct Dof {
    int parent;        // index into dofs_, or -1
    std::size_t link;  // index into links_
    Twist twist;       // motion at unit velocity
    double rounding;   // a diagonal of the mass matrix as small as this is zero
  };

  void read(const btMultiBody& body);
  void readBase(const btMultiBody& body);
  void readLink(const btMultiBody& body, int index);
  static void setInertia(Link& link, double mass, const Vec3& principal);
  void addDof(Link& link, const Vec3& angular, const Vec3& linearAtCentre);
  void addComposites();
  void fillMassMatrix();
  void factor();
  void addToJacobian(int link, const Vec3& point, const Vec3& direction);
  double inverseMassAlongJacobian();
  double inversePivot(std::size_t dof);
  double& mass(std::size_t row, std::size_t column) { return mass_[row * dofs_.size() + column]; }

  Vec3 reference_ = Vec3::Zero();  // m, world frame
  std::vector<Link> links_;        // the base first
  std::vector<Dof> dofs_;
  std::vector<double> mass_;  // row by row, below the diagonal; after factor() its L and D
  std::vector<double> jacobian_;
};

}  // namespace carom::bullet
