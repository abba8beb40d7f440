#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "plugin/pybullet/body_description.h"

namespace carom {

using namespace plugin;

namespace {

using Form = ContactBody::Form;

b3::CollisionShape shape(b3::Geometry geometry, const std::array<double, 3>& dimensions) {
  b3::CollisionShape made{};
  made.geometry = geometry;
  made.dimensions = dimensions;
  made.frame[6] = 1.0;
  return made;
}

b3::DynamicsInfo dynamics(double mass, const std::array<double, 3>& inertia = {1.0, 1.0, 1.0}) {
  b3::DynamicsInfo made{};
  made.mass = mass;
  made.inertia = inertia;
  made.restitution = 0.7;
  made.bodyType = b3::kMultiBody;
  return made;
}

// Inertia in kg m^2 of a solid box, from its edges (m).
std::array<double, 3> boxInertia(double mass, double x, double y, double z) {
  return {mass / 12.0 * (y * y + z * z), mass / 12.0 * (x * x + z * z),
          mass / 12.0 * (x * x + y * y)};
}

BodyDescription describe(const b3::DynamicsInfo& info,
                         const std::vector<b3::CollisionShape>& shapes, bool held = false,
                         bool isLink = false) {
  RadiatorCache radiators;
  return describeBody(info, shapes, held, isLink, radiators);
}

double volume(const BodyDescription& body) {
  return 4.0 / 3.0 * std::numbers::pi * std::pow(body.sound.radius, 3);
}

TEST(PybulletDescription, BallOfTheWeightOfSteelIsOfSteel) {
  const auto body = describe(dynamics(4.11), {shape(b3::kSphere, {0.05, 0.05, 0.05})});  // 7850
  EXPECT_EQ(body.sound.material.name, "steel");
  EXPECT_EQ(body.sound.material.restitution, 0.7);
  EXPECT_NEAR(body.sound.radius, 0.05, 1e-12);
  EXPECT_EQ(body.contact.form, Form::sphere);
  EXPECT_EQ(body.contact.radius, 0.05);
  EXPECT_EQ(body.contact.restitution, 0.7);
}

TEST(PybulletDescription, RadiatesAsTheSphereOfItsVolume) {
  // Volumes in litres: pi 0.1^2 0.3; the two half balls add 4/3 pi 0.1^3.
  EXPECT_NEAR(volume(describe(dynamics(1.0), {shape(b3::kCylinder, {0.3, 0.1, 0.0})})) * 1e3,
              9.4248, 1e-4);
  EXPECT_NEAR(volume(describe(dynamics(1.0), {shape(b3::kCapsule, {0.3, 0.1, 0.0})})) * 1e3,
              13.6136, 1e-4);
  EXPECT_NEAR(volume(describe(dynamics(1.0), {shape(b3::kBox, {0.1, 0.1, 0.1}),
                                              shape(b3::kBox, {0.2, 0.1, 0.1})})) *
                  1e3,
              3.0, 1e-9);
}

TEST(PybulletDescription, WithoutAShapeItIsTheBoxOfItsInertia) {
  b3::DynamicsInfo rigid = dynamics(2.0, boxInertia(2.0, 0.1, 0.2, 0.3));
  rigid.bodyType = b3::kRigidBody;
  const auto body = describe(rigid, {});
  EXPECT_NEAR(volume(body), 0.006, 1e-12);
  EXPECT_FALSE(body.contact.restitution) << "the server does not tell it";
}

TEST(PybulletDescription, MeshFillsHalfTheBoxOfItsInertia) {
  const auto body =
      describe(dynamics(2.0, boxInertia(2.0, 0.1, 0.2, 0.3)), {shape(b3::kMesh, {1.0, 1.0, 1.0})});
  EXPECT_NEAR(volume(body), 0.003, 1e-12);
}

TEST(PybulletDescription, BoxPushesTheAirWithItsFacesUnlessItIsALink) {
  const std::vector<b3::CollisionShape> plate = {shape(b3::kBox, {0.4, 0.4, 0.02})};
  const auto body = describe(dynamics(1.0, boxInertia(1.0, 0.4, 0.4, 0.02)), plate);
  ASSERT_TRUE(body.sound.shape);
  EXPECT_NEAR(body.sound.shape->volume, 0.0032, 1e-9);
  // A thin square plate with edge a that is hit flat drags 0.579 pi/4 a^3 of air (DNV-RP-C205,
  // table D-2).
  EXPECT_GT(body.sound.shape->addedVolume(2, 2), 0.579 * 0.25 * std::numbers::pi * 0.064);
  EXPECT_LT(body.sound.shape->addedVolume(0, 0), 0.1 * body.sound.shape->addedVolume(2, 2));
  EXPECT_GT(body.sound.inverseInertia(0, 0), 0.0);
  EXPECT_FALSE(describe(dynamics(1.0), plate, false, true).sound.shape);
}

TEST(PybulletDescription, WhatNothingMovesIsOfConcreteAndSilent) {
  b3::DynamicsInfo isStatic = dynamics(3.0);
  isStatic.dynamicType = 1;
  const std::vector<b3::CollisionShape> ball = {shape(b3::kSphere, {0.05, 0.05, 0.05})};
  for (const BodyDescription& body :
       {describe(dynamics(0.0), ball), describe(isStatic, ball),
        describe(dynamics(3.0), ball, true),
        describe(dynamics(0.0), {shape(b3::kPlane, {0.0, 0.0, 1.0})})}) {
    EXPECT_TRUE(std::isinf(body.sound.mass));
    EXPECT_FALSE(body.contact.isMovable());
    EXPECT_EQ(body.sound.material.name, "concrete");
  }
}

}  // namespace
}  // namespace carom
