#include "bullet_bridge/bodies/multibody_link.h"

#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/bullet_bridge/vectors.h"
#include "tests/support/no_alloc_scope.h"

namespace carom {

using namespace bullet;

namespace {

constexpr bool kDouble = sizeof(btScalar) == 8;
constexpr double kLinkTolerance = kDouble ? 1e-12 : 1e-5;  // relative rounding of numbers in Bullet

enum class Joint { revolute, prismatic, spherical, planar, fixed };

/// A multibody with a collider on its base and on each link.
class Tree {
 public:
  Tree(int links, double baseMass, const Vec3& baseInertia, bool fixedBase)
      : body(links, btScalar(baseMass), bt(baseInertia), fixedBase, false) {
    body.setLinearDamping(0);
    body.setAngularDamping(0);
  }

  struct Link {
    Joint joint = Joint::revolute;
    int parent = -1;
    double mass = 1.0;
    Vec3 inertia = Vec3::Zero();
    Vec3 axis = Vec3::UnitZ();
    Vec3 toPivot = Vec3::Zero();     // from the parent's centre, in the parent's axes
    Vec3 fromPivot = Vec3::UnitX();  // to the link's own centre, in its own axes
    btQuaternion turn{0, 0, 0, 1};
  };

  void set(int index, const Link& link) {
    const auto mass = btScalar(link.mass);
    const btVector3 inertia = bt(link.inertia);
    const btVector3 toPivot = bt(link.toPivot);
    const btVector3 fromPivot = bt(link.fromPivot);
    const btVector3 axis = bt(link.axis);
    switch (link.joint) {
      case Joint::revolute:
        return body.setupRevolute(index, mass, inertia, link.parent, link.turn, axis, toPivot,
                                  fromPivot);
      case Joint::prismatic:
        return body.setupPrismatic(index, mass, inertia, link.parent, link.turn, axis, toPivot,
                                   fromPivot, false);
      case Joint::spherical:
        return body.setupSpherical(index, mass, inertia, link.parent, link.turn, toPivot,
                                   fromPivot);
      case Joint::planar:
        return body.setupPlanar(index, mass, inertia, link.parent, link.turn, axis, toPivot);
      case Joint::fixed:
        return body.setupFixed(index, mass, inertia, link.parent, link.turn, toPivot, fromPivot);
    }
  }

  void finish() {
    body.finalizeMultiDof();
    for (int index = -1; index < body.getNumLinks(); ++index) {
      colliders.push_back(std::make_unique<btMultiBodyLinkCollider>(&body, index));
      if (index < 0)
        body.setBaseCollider(colliders.back().get());
      else
        body.getLink(index).m_collider = colliders.back().get();
    }
    updateColliders();
  }

  void updateColliders() {
    btAlignedObjectArray<btQuaternion> rotations;
    btAlignedObjectArray<btVector3> origins;
    body.forwardKinematics(rotations, origins);
    body.updateCollisionObjectWorldTransforms(rotations, origins);
  }

  const btMultiBodyLinkCollider& operator[](int link) const {
    return *colliders[static_cast<std::size_t>(link) + 1];
  }
  Vec3 centre(int link) const { return vec((*this)[link].getWorldTransform().getOrigin()); }

  btMultiBody body;
  std::vector<std::unique_ptr<btMultiBodyLinkCollider>> colliders;
};

double draw(std::mt19937& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
Vec3 drawVector(std::mt19937& random) {
  return {draw(random, -1, 1), draw(random, -1, 1), draw(random, -1, 1)};
}
btQuaternion drawTurn(std::mt19937& random) {
  return {bt(drawVector(random).normalized()), btScalar(draw(random, -3, 3))};
}

/// A tree with branches and every type of joint, at random poses and velocities.
std::unique_ptr<Tree> randomTree(unsigned seed, bool fixedBase) {
  std::mt19937 random(seed);
  const std::vector<Joint> joints = {Joint::revolute,  Joint::spherical, Joint::fixed,
                                     Joint::prismatic, Joint::planar,    Joint::revolute,
                                     Joint::spherical, Joint::revolute};
  const std::vector<int> parents = {-1, 0, 1, 1, 0, 3, -1, 6};
  auto tree = std::make_unique<Tree>(8, 1.5, Vec3(0.02, 0.03, 0.04), fixedBase);
  for (int i = 0; i < 8; ++i) {
    tree->set(i, {.joint = joints[static_cast<std::size_t>(i)],
                  .parent = parents[static_cast<std::size_t>(i)],
                  .mass = draw(random, 0.2, 2.0),
                  .inertia = Vec3(0.01, 0.012, 0.015) * draw(random, 0.5, 2.0),
                  .axis = drawVector(random).normalized(),
                  .toPivot = 0.3 * drawVector(random),
                  .fromPivot = 0.3 * drawVector(random),
                  .turn = drawTurn(random)});
  }
  tree->finish();
  tree->body.setBasePos(bt(drawVector(random)));
  tree->body.setWorldToBaseRot(drawTurn(random));
  if (!fixedBase) {
    tree->body.setBaseVel(bt(drawVector(random)));
    tree->body.setBaseOmega(bt(2.0 * drawVector(random)));
  }
  for (int i = 0; i < 8; ++i) {
    std::vector<double> place(7, 0.0);
    std::vector<double> rate(6);
    for (double& value : rate)
      value = draw(random, -2, 2);
    if (joints[static_cast<std::size_t>(i)] == Joint::spherical) {
      const btQuaternion turn = drawTurn(random);
      place = {double(turn.x()), double(turn.y()), double(turn.z()), double(turn.w())};
    } else {
      for (double& value : place)
        value = draw(random, -1, 1);
    }
    tree->body.setJointPosMultiDof(i, place.data());
    tree->body.setJointVelMultiDof(i, rate.data());
  }
  tree->updateColliders();
  return tree;
}

// --- velocities ---

TEST(LinkVelocity, OfAFreeBaseIsItsOwn) {
  Tree tree(0, 2.0, Vec3(1, 1, 1), false);
  tree.finish();
  tree.body.setBaseVel(bt({1, 2, 3}));
  tree.body.setBaseOmega(bt({4, 5, 6}));
  const LinkVelocity velocity = linkVelocity(tree[-1]);
  EXPECT_EQ(velocity.linear, Vec3(1, 2, 3));
  EXPECT_EQ(velocity.angular, Vec3(4, 5, 6));
}

TEST(LinkVelocity, OfAPendulumIsRateTimesLengthAcrossTheRod) {
  Tree tree(1, 0.0, Vec3::Zero(), true);
  tree.set(0, {.fromPivot = {0.7, 0, 0}});
  tree.finish();
  tree.body.setJointPos(0, btScalar(M_PI / 2));  // the rod now points along y
  tree.body.setJointVel(0, btScalar(3));
  const LinkVelocity velocity = linkVelocity(tree[0]);
  EXPECT_LT((velocity.linear - Vec3(-2.1, 0, 0)).norm(), 1e-6);
  EXPECT_LT((velocity.angular - Vec3(0, 0, 3)).norm(), 1e-6);
}

Vec3 turnBetween(const btQuaternion& from, const btQuaternion& to) {
  btQuaternion change = to * from.inverse();
  if (change.w() < 0) change = -change;
  return 2.0 * vec(btVector3(change.x(), change.y(), change.z()));
}

btTransform after(Tree& tree, int link, double step) {
  tree.body.stepPositionsMultiDof(btScalar(step));
  tree.updateColliders();
  return tree[link].getWorldTransform();
}

// The expected velocities are central differences over Bullet's own integration, forwards and
// backwards from one state. Float positions of some metres resolve 1e-7 m.
TEST(LinkVelocity, IsTheRateOfTheCollidersWorldTransformForEveryTypeOfJoint) {
  const double step = kDouble ? 1e-4 : 2e-3;
  const double tolerance = kDouble ? 3e-6 : 2e-3;
  for (unsigned seed = 0; seed < 20; ++seed) {
    for (int link = -1; link < 8; ++link) {
      const bool fixedBase = seed % 2 == 0;
      const LinkVelocity velocity = linkVelocity((*randomTree(seed, fixedBase))[link]);
      const btTransform late = after(*randomTree(seed, fixedBase), link, step);
      const btTransform early = after(*randomTree(seed, fixedBase), link, -step);
      const Vec3 linear = vec(late.getOrigin() - early.getOrigin()) / (2.0 * step);
      const Vec3 angular = turnBetween(early.getRotation(), late.getRotation()) / (2.0 * step);
      EXPECT_LT((velocity.linear - linear).norm(), tolerance)
          << "seed " << seed << ", link " << link;
      EXPECT_LT((velocity.angular - angular).norm(), tolerance)
          << "seed " << seed << ", link " << link;
    }
  }
}

// --- effective mass ---

TEST(MultibodyMass, OfAFreeBaseIsThatOfARigidBody) {
  const Vec3 principal(0.02, 0.03, 0.05);
  Tree tree(0, 2.0, principal, false);
  tree.finish();
  const btQuaternion turn(bt({0.6, 0, 0.8}), btScalar(1.1));
  tree.body.setBasePos(bt({5, -2, 1}));
  tree.body.setWorldToBaseRot(turn.inverse());
  const Eigen::Matrix3d rotation =
      Quat(double(turn.w()), double(turn.x()), double(turn.y()), double(turn.z()))
          .toRotationMatrix();
  const Eigen::Matrix3d inverseInertia =
      rotation * principal.cwiseInverse().asDiagonal() * rotation.transpose();
  MultibodyMass mass;
  std::mt19937 random(3);
  for (int trial = 0; trial < 20; ++trial) {
    const Vec3 arm = 0.2 * drawVector(random);
    const Vec3 n = drawVector(random).normalized();
    const Vec3 lever = arm.cross(n);
    const double expected = 1.0 / 2.0 + lever.dot(inverseInertia * lever);
    EXPECT_NEAR(mass.inverseEffectiveMass(tree[-1], Vec3(5, -2, 1) + arm, n), expected,
                kLinkTolerance * expected);
  }
}

TEST(MultibodyMass, AFixedBaseDoesNotMove) {
  Tree tree(1, 3.0, Vec3(1, 1, 1), true);
  tree.set(0, {});
  tree.finish();
  MultibodyMass mass;
  EXPECT_EQ(mass.inverseEffectiveMass(tree[-1], Vec3(0.1, 0, 0), Vec3::UnitY()), 0.0);
  tree.body.setFixedBase(false);
  EXPECT_GT(mass.inverseEffectiveMass(tree[-1], Vec3(0.1, 0, 0), Vec3::UnitY()), 0.0);
}

TEST(MultibodyMass, OfAPointPendulumIsItsMassAcrossTheRodAndNothingAlongIt) {
  Tree tree(1, 0.0, Vec3::Zero(), true);
  tree.set(0, {.mass = 0.4, .fromPivot = {0.7, 0, 0}});
  tree.finish();
  MultibodyMass mass;
  const Vec3 bob = tree.centre(0);
  EXPECT_NEAR(mass.inverseEffectiveMass(tree[0], bob, Vec3::UnitY()), 1.0 / 0.4, 1e-6);
  EXPECT_NEAR(mass.inverseEffectiveMass(tree[0], bob, Vec3::UnitX()), 0.0, 1e-12);
  EXPECT_NEAR(mass.inverseEffectiveMass(tree[0], bob, Vec3::UnitZ()), 0.0, 1e-12);
  // The middle of the rod moves at half the speed.
  EXPECT_NEAR(mass.inverseEffectiveMass(tree[0], 0.5 * bob, Vec3::UnitY()), 0.25 / 0.4, 1e-6);
}

// A point on a ball joint has no inertia about its own rod; this motion must not lead to a division
// by zero.
TEST(MultibodyMass, OfAPointOnABallJointIsItsMassAcrossTheRod) {
  Tree tree(1, 0.0, Vec3::Zero(), true);
  tree.set(0, {.joint = Joint::spherical, .mass = 0.4, .fromPivot = {0.3, 0.4, -0.2}});
  tree.finish();
  MultibodyMass mass;
  const Vec3 bob = tree.centre(0);
  const Vec3 across = bob.cross(Vec3::UnitY()).normalized();
  EXPECT_NEAR(mass.inverseEffectiveMass(tree[0], bob, across), 1.0 / 0.4, 1e-5);
  EXPECT_NEAR(mass.inverseEffectiveMass(tree[0], bob, bob.normalized()), 0.0, 1e-6);
}

TEST(MultibodyMass, OfASliderIsItsMassAlongTheAxisAndNothingAcross) {
  Tree tree(1, 0.0, Vec3::Zero(), true);
  tree.set(0,
           {.joint = Joint::prismatic, .mass = 1.6, .inertia = {1, 2, 3}, .axis = {0.6, 0.8, 0}});
  tree.finish();
  MultibodyMass mass;
  const Vec3 anywhere(3, 1, 4);
  EXPECT_NEAR(mass.inverseEffectiveMass(tree[0], anywhere, Vec3(0.6, 0.8, 0)), 1.0 / 1.6, 1e-6);
  EXPECT_NEAR(mass.inverseEffectiveMass(tree[0], anywhere, Vec3(-0.8, 0.6, 0)), 0.0, 1e-12);
  EXPECT_NEAR(mass.inverseEffectiveMass(tree[0], anywhere, Vec3::UnitZ()), 0.0, 1e-12);
}

TEST(MultibodyMass, LinksFixedToABaseAddToIt) {
  Tree tree(1, 1.0, Vec3(0.1, 0.1, 0.1), false);
  tree.set(0, {.joint = Joint::fixed, .mass = 3.0, .inertia = {0.1, 0.1, 0.1}});
  tree.finish();
  MultibodyMass mass;
  const Vec3 together = 0.75 * tree.centre(0);
  EXPECT_NEAR(mass.inverseEffectiveMass(tree[0], together, Vec3::UnitY()), 0.25, 1e-6);
}

// The oracle for two rods in a plane, hinged at the origin and at the first rod's end, is their 2x2
// mass matrix in the rate of the first rod and the rate of the second relative to it.
TEST(MultibodyMass, OfADoublePendulumIsThatOfItsTwoByTwoMassMatrix) {
  const double m1 = 0.5, m2 = 0.8, length = 0.6, half = 0.3, i1 = 0.02, i2 = 0.03;
  Tree tree(2, 0.0, Vec3::Zero(), true);
  tree.set(0, {.mass = m1, .inertia = {i1, i1, i1}, .fromPivot = {half, 0, 0}});
  tree.set(1, {.parent = 0,
               .mass = m2,
               .inertia = {i2, i2, i2},
               .toPivot = {half, 0, 0},
               .fromPivot = {half, 0, 0}});
  tree.finish();
  MultibodyMass mass;
  for (const double bend : {0.0, 0.4, 1.7, 3.0}) {
    tree.body.setJointPos(0, btScalar(0.3));
    tree.body.setJointPos(1, btScalar(bend));
    const double c = std::cos(bend);
    Eigen::Matrix2d matrix;
    matrix(1, 1) = i2 + m2 * half * half;
    matrix(0, 1) = matrix(1, 0) = matrix(1, 1) + m2 * length * half * c;
    matrix(0, 0) =
        i1 + m1 * half * half + i2 + m2 * (length * length + half * half + 2.0 * length * half * c);
    const Vec3 hinge(length * std::cos(0.3), length * std::sin(0.3), 0.0);
    const Vec3 reach(std::cos(0.3 + bend), std::sin(0.3 + bend), 0.0);
    const Vec3 tip = hinge + length * reach;
    const Vec3 n = Vec3(0.28, 0.96, 0.0);
    const Eigen::Vector2d jacobian(n.dot(Vec3::UnitZ().cross(tip)),
                                   n.dot(Vec3::UnitZ().cross(tip - hinge)));
    const double expected = jacobian.dot(matrix.inverse() * jacobian);
    EXPECT_NEAR(mass.inverseEffectiveMass(tree[1], tip, n), expected, 1e-5 * expected) << bend;

    // The tip is struck against the middle of the first rod, which moves along.
    const Eigen::Vector2d relative =
        jacobian - Eigen::Vector2d(n.dot(Vec3::UnitZ().cross(0.5 * hinge)), 0.0);
    const double between = relative.dot(matrix.inverse() * relative);
    EXPECT_NEAR(mass.inverseEffectiveMass(tree[1], tip, tree[0], 0.5 * hinge, n), between,
                1e-5 * expected)
        << bend;
  }
}

TEST(MultibodyMass, OfTwoMultibodiesAddsUp) {
  const auto first = randomTree(1, false);
  const auto second = randomTree(2, true);
  MultibodyMass mass;
  const Vec3 point(0.3, 0.2, 0.1);
  const Vec3 n = Vec3(1, 2, 2) / 3.0;
  EXPECT_DOUBLE_EQ(mass.inverseEffectiveMass((*first)[5], point, (*second)[3], point, n),
                   mass.inverseEffectiveMass((*first)[5], point, n) +
                       mass.inverseEffectiveMass((*second)[3], point, n));
}

TEST(MultibodyMass, APointAgainstItselfIsNotMovedByOppositeImpulses) {
  const auto tree = randomTree(4, false);
  MultibodyMass mass;
  const Vec3 point = tree->centre(5);
  EXPECT_NEAR(mass.inverseEffectiveMass((*tree)[5], point, (*tree)[5], point, Vec3::UnitX()), 0.0,
              1e-12);
}

TEST(MultibodyMass, AllocatesNothingOnceItHasSeenTheLargest) {
  const auto large = randomTree(1, false);
  Tree small(0, 1.0, Vec3(1, 1, 1), false);
  small.finish();
  MultibodyMass mass;
  mass.inverseEffectiveMass((*large)[5], Vec3::Zero(), Vec3::UnitX());
  const test::NoAllocScope scope;
  mass.inverseEffectiveMass(small[-1], Vec3::Zero(), Vec3::UnitX());
  mass.inverseEffectiveMass((*large)[5], Vec3::Zero(), (*large)[2], Vec3::UnitY(), Vec3::UnitX());
  linkVelocity((*large)[5]);
  EXPECT_EQ(scope.allocations(), 0u);
}

/// The answer of Bullet's own articulated body algorithm, brought up to date by a step of no
/// duration.
class BulletAnswer {
 public:
  explicit BulletAnswer(btMultiBody& body) : body_(body) {
    body.computeAccelerationsArticulatedBodyAlgorithmMultiDof(0, r_, v_, m_, false, false, false);
  }
  std::vector<btScalar> jacobian(int link, const Vec3& point, const Vec3& n) {
    std::vector<btScalar> out(static_cast<std::size_t>(6 + body_.getNumDofs()));
    body_.fillConstraintJacobianMultiDof(link, bt(point), bt({0, 0, 0}), bt(n), out.data(), r_, v_,
                                         m_);
    return out;
  }
  double inverseMass(const std::vector<btScalar>& jacobian) {
    std::vector<btScalar> change(jacobian.size());
    body_.calcAccelerationDeltasMultiDof(jacobian.data(), change.data(), r_, v_);
    double sum = 0.0;
    for (std::size_t i = 0; i < jacobian.size(); ++i)
      sum += double(jacobian[i]) * double(change[i]);
    return sum;
  }

 private:
  btMultiBody& body_;
  btAlignedObjectArray<btScalar> r_;
  btAlignedObjectArray<btVector3> v_;
  btAlignedObjectArray<btMatrix3x3> m_;
};

TEST(MultibodyMass, AgreesWithBulletsArticulatedBodyAlgorithmOnTreesOfEveryTypeOfJoint) {
  const double tolerance = kDouble ? 1e-9 : 2e-3;
  MultibodyMass mass;
  std::mt19937 random(11);
  for (unsigned seed = 0; seed < 30; ++seed) {
    const auto tree = randomTree(seed, seed % 2 == 0);
    BulletAnswer bullet(tree->body);
    for (int link = -1; link < 8; ++link) {
      const Vec3 point = tree->centre(link) + 0.1 * drawVector(random);
      const Vec3 n = drawVector(random).normalized();
      auto jacobian = bullet.jacobian(link, point, n);
      const double expected = bullet.inverseMass(jacobian);
      EXPECT_NEAR(mass.inverseEffectiveMass((*tree)[link], point, n), expected,
                  tolerance * (expected + 0.1))
          << "seed " << seed << ", link " << link;

      const Vec3 otherPoint = tree->centre(7) + 0.1 * drawVector(random);
      const auto other = bullet.jacobian(7, otherPoint, n);
      for (std::size_t i = 0; i < jacobian.size(); ++i)
        jacobian[i] -= other[i];
      const double relative = bullet.inverseMass(jacobian);
      EXPECT_NEAR(mass.inverseEffectiveMass((*tree)[link], point, (*tree)[7], otherPoint, n),
                  relative, tolerance * (relative + 0.1))
          << "seed " << seed << ", link " << link;
    }
  }
}

}  // namespace
}  // namespace carom
