#include "plugin/pybullet/body_shape.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include <BulletCollision/CollisionShapes/btMultiSphereShape.h>
#include <btBulletDynamicsCommon.h>
#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace carom {

using namespace plugin;

namespace {

using Form = ContactBody::Form;

constexpr double kBodyMass = 1.7;  // kg
constexpr double kShare = 3e-4;    // of sizes, that what is told may be off

/// The signs of one of Bullet's own shapes, where its body stands.
ShapeSigns signsOf(const btCollisionShape& shape, double mass, const Quat& orientation,
                   const Vec3& position = Vec3::Zero()) {
  ShapeSigns signs;
  btVector3 inertia(0, 0, 0);
  if (mass > 0.0) shape.calculateLocalInertia(btScalar(mass), inertia);
  signs.dynamics.mass = mass;
  signs.dynamics.margin = static_cast<double>(shape.getMargin());
  for (int axis = 0; axis < 3; ++axis)
    signs.dynamics.inertia[static_cast<std::size_t>(axis)] = static_cast<double>(inertia[axis]);
  btTransform pose;
  pose.setOrigin({btScalar(position.x()), btScalar(position.y()), btScalar(position.z())});
  pose.setRotation({btScalar(orientation.x()), btScalar(orientation.y()), btScalar(orientation.z()),
                    btScalar(orientation.w())});
  btVector3 least;
  btVector3 most;
  shape.getAabb(pose, least, most);
  Vec3 half;
  for (int axis = 0; axis < 3; ++axis)
    half[axis] = 0.5 * static_cast<double>(most[axis] - least[axis]);
  signs.halfBounds = half;
  signs.orientation = orientation;
  return signs;
}

/// Orientations that a body may have: none, turned by quarters and eighths, and any.
std::vector<Quat> orientations() {
  std::vector<Quat> all = {Quat::Identity()};
  for (const double angle : {0.5 * std::numbers::pi, 0.25 * std::numbers::pi})
    for (int axis = 0; axis < 3; ++axis)
      all.emplace_back(Eigen::AngleAxisd(angle, Vec3::Unit(axis)));
  Random random(7);
  for (int count = 0; count < 40; ++count)
    all.push_back(Quat(random.between(-1, 1), random.between(-1, 1), random.between(-1, 1),
                       random.between(-1, 1))
                      .normalized());
  return all;
}

template <class Expect>
void inAnyOrientation(const btCollisionShape& shape, const Expect& expect) {
  for (const Quat& orientation : orientations())
    expect(shapeOf(signsOf(shape, kBodyMass, orientation, {1.0, -2.0, 3.0})));
}

TEST(BodyShape, SpheresAreThoseWhoseMarginIsTheirRadius) {
  for (const double radius : {0.004, 0.05, 1.3})
    inAnyOrientation(btSphereShape(btScalar(radius)), [&](const BodyShape& shape) {
      ASSERT_EQ(shape.form, Form::sphere);
      EXPECT_NEAR(shape.radius, radius, 1e-6 * radius);
      EXPECT_NEAR(shape.volume, 4.18879 * std::pow(radius, 3), 1e-5 * std::pow(radius, 3));
    });
}

TEST(BodyShape, BoxesHaveTheirEdges) {
  for (const btScalar margin : {btScalar(0.001), btScalar(0.04)}) {
    btBoxShape box(btVector3(btScalar(0.05), btScalar(0.1), btScalar(0.25)));
    box.setMargin(margin);
    inAnyOrientation(box, [](const BodyShape& shape) {
      ASSERT_EQ(shape.form, Form::box);
      EXPECT_LT((shape.edges - Vec3(0.1, 0.2, 0.5)).norm(), kShare);
      EXPECT_NEAR(shape.volume, 0.01, 3.0 * kShare * 0.01);
    });
  }
}

TEST(BodyShape, ACubeIsNoSphereAndNoCylinder) {
  btBoxShape cube(btVector3(btScalar(0.05), btScalar(0.05), btScalar(0.05)));
  cube.setMargin(btScalar(0.001));
  inAnyOrientation(cube, [](const BodyShape& shape) { EXPECT_EQ(shape.form, Form::box); });
}

TEST(BodyShape, CylindersStandAlongZ) {
  btCylinderShapeZ can(btVector3(btScalar(0.03), btScalar(0.03), btScalar(0.06)));
  can.setMargin(btScalar(0.001));
  inAnyOrientation(can, [](const BodyShape& shape) {
    ASSERT_EQ(shape.form, Form::cylinder);
    EXPECT_NEAR(shape.radius, 0.03, kShare * 0.06);
    EXPECT_NEAR(shape.volume, std::numbers::pi * 0.03 * 0.03 * 0.12, 1e-6);
  });
}

TEST(BodyShape, CapsulesAreBoxesAsWideAsTheirMarginIs) {
  const btCapsuleShapeZ capsule(btScalar(0.1), btScalar(0.3));
  inAnyOrientation(capsule, [](const BodyShape& shape) {
    ASSERT_EQ(shape.form, Form::capsule);
    EXPECT_NEAR(shape.radius, 0.1, kShare * 0.25);
    EXPECT_NEAR(shape.volume, 0.0136136, 1e-5);
  });
}

TEST(BodyShape, HullsAndSetsOfSpheresAreNeither) {
  btConvexHullShape hull;
  for (unsigned corner = 0; corner < 8; ++corner)
    hull.addPoint(btVector3(btScalar(corner & 1U ? 0.05 : -0.05),
                            btScalar(corner & 2U ? 0.1 : -0.1),
                            btScalar(corner & 4U ? 0.25 : -0.25)));
  for (const btScalar margin : {btScalar(0.001), btScalar(0.04)}) {
    hull.setMargin(margin);
    hull.recalcLocalAabb();
    inAnyOrientation(hull, [](const BodyShape& shape) { EXPECT_EQ(shape.form, Form::other); });
  }
  // A capsule from point to point, as MJCF files have it.
  const std::array<btVector3, 2> centres = {btVector3(0, 0, btScalar(0.15)),
                                            btVector3(0, 0, btScalar(-0.15))};
  const std::array<btScalar, 2> radii = {btScalar(0.1), btScalar(0.1)};
  const btMultiSphereShape pair(centres.data(), radii.data(), 2);
  inAnyOrientation(pair, [](const BodyShape& shape) {
    EXPECT_EQ(shape.form, Form::other);
    EXPECT_NEAR(shape.volume, 0.5 * 0.2 * 0.2 * 0.5, 1e-4);  // half of the box around it
  });
}

TEST(BodyShape, OfWhatDoesNotMoveSpheresAndPlanesAreTold) {
  const btStaticPlaneShape plane(btVector3(0, 0, 1), 0);
  EXPECT_EQ(shapeOf(signsOf(plane, 0.0, Quat::Identity())).form, Form::plane);
  EXPECT_EQ(shapeOf(signsOf(btSphereShape(btScalar(0.2)), 0.0, Quat::Identity())).form,
            Form::sphere);
  const btBoxShape box(btVector3(1, 2, 3));
  const BodyShape block = shapeOf(signsOf(box, 0.0, Quat::Identity()));
  EXPECT_EQ(block.form, Form::other);
  EXPECT_EQ(block.volume, 0.0);
}

TEST(BodyShape, NonsenseIsOfNoForm) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double number : {0.0, -1.0, 1e-300, 1e300, kNan, kInfinity}) {
    ShapeSigns signs;
    signs.dynamics.mass = 1.0;
    signs.dynamics.inertia = {number, number, number};
    signs.dynamics.margin = number;
    signs.halfBounds = Vec3(1.0, 1.0, 1.0);
    EXPECT_EQ(shapeOf(signs).form, Form::other) << number;
    signs.dynamics.mass = number;
    signs.halfBounds = std::nullopt;
    const BodyShape shape = shapeOf(signs);
    EXPECT_EQ(shape.form, Form::other) << number;
    EXPECT_FALSE(std::isnan(shape.volume)) << number;
  }
}

}  // namespace
}  // namespace carom
