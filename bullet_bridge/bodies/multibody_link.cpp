#include "bullet_bridge/bodies/multibody_link.h"

#include <BulletDynamics/Featherstone/btMultiBody.h>

#include "bullet_bridge/geometry/to_vec3.h"

namespace carom::bullet {
namespace {

constexpr double kTwistRounding = 1e-13;  // relative to the terms that cancel

// Bullet's rotations of multibodies take the outer frame's coordinates to the inner one's.
Eigen::Matrix3d outOf(const btQuaternion& into) {
  const Quat q(static_cast<double>(into.w()), static_cast<double>(into.x()),
               static_cast<double>(into.y()), static_cast<double>(into.z()));
  return q.normalized().toRotationMatrix().transpose();
}

Eigen::Matrix3d skew(const Vec3& v) {
  Eigen::Matrix3d matrix;
  matrix << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return matrix;
}

struct MovingFrame {
  Eigen::Matrix3d rotation;
  LinkVelocity velocity;
};

MovingFrame movingFrame(const btMultiBody& body, int index) {
  if (index < 0) {
    return {outOf(body.getWorldToBaseRot()),
            {toVec3(body.getBaseVel()), toVec3(body.getBaseOmega())}};
  }
  const btMultibodyLink& link = body.getLink(index);
  MovingFrame frame = movingFrame(body, link.m_parent);
  frame.rotation = frame.rotation * outOf(link.m_cachedRotParentToThis);
  LinkVelocity& velocity = frame.velocity;
  velocity.linear += velocity.angular.cross(frame.rotation * toVec3(link.m_cachedRVector));
  for (int dof = 0; dof < link.m_dofCount; ++dof) {
    const auto rate = static_cast<double>(body.getJointVelMultiDof(index)[dof]);
    velocity.angular += rate * (frame.rotation * toVec3(link.getAxisTop(dof)));
    velocity.linear += rate * (frame.rotation * toVec3(link.getAxisBottom(dof)));
  }
  return frame;
}

}  // namespace

LinkVelocity linkVelocity(const btMultiBodyLinkCollider& link) {
  return movingFrame(*link.m_multiBody, link.m_link).velocity;
}

double MultibodyMass::inverseEffectiveMass(const btMultiBodyLinkCollider& link, const Vec3& point,
                                           const Vec3& direction) {
  read(*link.m_multiBody);
  addToJacobian(link.m_link, point, direction);
  return inverseMassAlongJacobian();
}

double MultibodyMass::inverseEffectiveMass(const btMultiBodyLinkCollider& first,
                                           const Vec3& firstPoint,
                                           const btMultiBodyLinkCollider& second,
                                           const Vec3& secondPoint, const Vec3& direction) {
  if (first.m_multiBody != second.m_multiBody) {
    return inverseEffectiveMass(first, firstPoint, direction) +
           inverseEffectiveMass(second, secondPoint, direction);
  }
  read(*first.m_multiBody);
  addToJacobian(first.m_link, firstPoint, direction);
  addToJacobian(second.m_link, secondPoint, -direction);
  return inverseMassAlongJacobian();
}

void MultibodyMass::read(const btMultiBody& body) {
  links_.clear();
  dofs_.clear();
  reference_ = toVec3(body.getBasePos());
  readBase(body);
  for (int index = 0; index < body.getNumLinks(); ++index)
    readLink(body, index);
  addComposites();
  mass_.assign(dofs_.size() * dofs_.size(), 0.0);
  jacobian_.assign(dofs_.size(), 0.0);
  fillMassMatrix();
  factor();
}

void MultibodyMass::readBase(const btMultiBody& body) {
  Link& base = links_.emplace_back();
  base.parent = base.lastDof = -1;
  base.rotation = outOf(body.getWorldToBaseRot());
  base.centre.setZero();
  setInertia(base, static_cast<double>(body.getBaseMass()), toVec3(body.getBaseInertia()));
  if (body.isBaseStaticOrKinematic()) return;
  for (int axis = 0; axis < 3; ++axis) {
    addDof(base, Vec3::Unit(axis), Vec3::Zero());
    addDof(base, Vec3::Zero(), Vec3::Unit(axis));
  }
}

void MultibodyMass::readLink(const btMultiBody& body, int index) {
  const btMultibodyLink& source = body.getLink(index);
  Link& link = links_.emplace_back();
  const Link& parent = links_[static_cast<std::size_t>(source.m_parent) + 1];
  link.parent = source.m_parent + 1;
  link.lastDof = parent.lastDof;
  link.rotation = parent.rotation * outOf(source.m_cachedRotParentToThis);
  link.centre = parent.centre + link.rotation * toVec3(source.m_cachedRVector);
  setInertia(link, static_cast<double>(source.m_mass), toVec3(source.m_inertiaLocal));
  if (body.isLinkAndAllAncestorsKinematic(index)) return;
  for (int dof = 0; dof < source.m_dofCount; ++dof) {
    addDof(link, link.rotation * toVec3(source.getAxisTop(dof)),
           link.rotation * toVec3(source.getAxisBottom(dof)));
  }
}

// `principal` holds the moments of inertia (kg m^2) about the centre of mass, along the link's own
// axes.
void MultibodyMass::setInertia(Link& link, double mass, const Vec3& principal) {
  const Eigen::Matrix3d arm = skew(link.centre);
  link.composite.mass = mass;
  link.composite.moment = mass * link.centre;
  link.composite.second =
      link.rotation * principal.asDiagonal() * link.rotation.transpose() - mass * arm * arm;
}

void MultibodyMass::addDof(Link& link, const Vec3& angular, const Vec3& linearAtCentre) {
  dofs_.push_back({.parent = link.lastDof,
                   .link = links_.size() - 1,
                   .twist = {angular, linearAtCentre - angular.cross(link.centre)},
                   .rounding = 0.0});
  link.lastDof = static_cast<int>(dofs_.size()) - 1;
}

// The loop runs backwards, as a link comes after its parent.
void MultibodyMass::addComposites() {
  for (std::size_t index = links_.size(); index-- > 1;) {
    const Inertia& own = links_[index].composite;
    Inertia& onto = links_[static_cast<std::size_t>(links_[index].parent)].composite;
    onto.mass += own.mass;
    onto.moment += own.moment;
    onto.second += own.second;
  }
}

// An entry is the momentum of all that one joint moves, projected on the motion of the other; it is
// zero for joints on different branches.
void MultibodyMass::fillMassMatrix() {
  for (std::size_t row = 0; row < dofs_.size(); ++row) {
    const Inertia& moved = links_[dofs_[row].link].composite;
    const Twist& twist = dofs_[row].twist;
    dofs_[row].rounding = kTwistRounding * (moved.mass * twist.linear.squaredNorm() +
                                            moved.second.trace() * twist.angular.squaredNorm());
    const Vec3 momentum = moved.mass * twist.linear + twist.angular.cross(moved.moment);
    const Vec3 spin = moved.second * twist.angular + moved.moment.cross(twist.linear);
    for (int column = static_cast<int>(row); column >= 0;) {
      const Dof& felt = dofs_[static_cast<std::size_t>(column)];
      mass(row, static_cast<std::size_t>(column)) =
          momentum.dot(felt.twist.linear) + spin.dot(felt.twist.angular);
      column = felt.parent;
    }
  }
}

// Factors M = L^T D L from the leaves on, which leaves the zeros of the tree zero. L has a unit
// diagonal, on which D is kept.
void MultibodyMass::factor() {
  const auto parentOf = [&](std::size_t dof) { return dofs_[dof].parent; };
  for (std::size_t leaf = dofs_.size(); leaf-- > 0;) {
    const double inverse = inversePivot(leaf);
    for (int i = parentOf(leaf); i >= 0; i = parentOf(static_cast<std::size_t>(i))) {
      const auto row = static_cast<std::size_t>(i);
      const double factor = mass(leaf, row) * inverse;
      for (int column = i; column >= 0; column = parentOf(static_cast<std::size_t>(column)))
        mass(row, static_cast<std::size_t>(column)) -=
            factor * mass(leaf, static_cast<std::size_t>(column));
      mass(leaf, row) = factor;
    }
  }
}

// A motion that moves no mass is taken as locked.
double MultibodyMass::inversePivot(std::size_t dof) {
  const double pivot = mass(dof, dof);
  return pivot > dofs_[dof].rounding ? 1.0 / pivot : 0.0;
}

void MultibodyMass::addToJacobian(int link, const Vec3& point, const Vec3& direction) {
  const Vec3 place = point - reference_;
  for (int dof = links_[static_cast<std::size_t>(link) + 1].lastDof; dof >= 0;) {
    const Dof& moving = dofs_[static_cast<std::size_t>(dof)];
    jacobian_[static_cast<std::size_t>(dof)] +=
        direction.dot(moving.twist.linear + moving.twist.angular.cross(place));
    dof = moving.parent;
  }
}

// J M^-1 J^T = |D^-1/2 L^-T J^T|^2
double MultibodyMass::inverseMassAlongJacobian() {
  double sum = 0.0;
  for (std::size_t leaf = dofs_.size(); leaf-- > 0;) {
    const double along = jacobian_[leaf];
    for (int i = dofs_[leaf].parent; i >= 0; i = dofs_[static_cast<std::size_t>(i)].parent) {
      const auto row = static_cast<std::size_t>(i);
      jacobian_[row] -= mass(leaf, row) * along;
    }
    sum += along * along * inversePivot(leaf);
  }
  return sum;
}

}  // namespace carom::bullet
