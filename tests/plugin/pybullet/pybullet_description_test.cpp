#include <array>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "plugin/pybullet/body_description.h"

namespace carom {

using namespace plugin;

namespace {

using Form = ContactBody::Form;

/// The signs of a solid box with these edges (m), in the axes of the world.
ShapeSigns box(double mass, const Vec3& edges) {
  ShapeSigns signs;
  signs.dynamics.mass = mass;
  const Vec3 squares = edges.cwiseAbs2();
  for (int axis = 0; axis < 3; ++axis)
    signs.dynamics.inertia[static_cast<std::size_t>(axis)] =
        mass / 12.0 * (squares.sum() - squares[axis]);
  signs.dynamics.margin = 0.001;
  signs.dynamics.restitution = 0.7;
  signs.dynamics.bodyType = b3::kMultiBody;
  signs.halfBounds = 0.5 * edges;
  return signs;
}

ShapeSigns ball(double mass, double radius) {
  ShapeSigns signs = box(mass, Vec3::Constant(2.0 * radius));
  signs.dynamics.inertia.fill(0.4 * mass * radius * radius);
  signs.dynamics.margin = radius;
  return signs;
}

BodyDescription describe(const ShapeSigns& signs, bool held = false, bool isLink = false) {
  RadiatorCache radiators;
  return describeBody(signs, held, isLink, radiators);
}

double volume(const BodyDescription& body) {
  return 4.0 / 3.0 * std::numbers::pi * std::pow(body.sound.radius, 3);
}

TEST(PybulletDescription, BallOfTheWeightOfSteelIsOfSteel) {
  const auto body = describe(ball(4.11, 0.05));  // 7850 kg/m^3
  EXPECT_EQ(body.sound.material.name, "steel");
  EXPECT_EQ(body.sound.material.restitution, 0.7);
  EXPECT_NEAR(body.sound.radius, 0.05, 1e-12);
  EXPECT_EQ(body.contact.form, Form::sphere);
  EXPECT_EQ(body.contact.radius, 0.05);
  EXPECT_EQ(body.contact.restitution, 0.7);
}

TEST(PybulletDescription, OfARigidBodyTheShapeIsKnownAndTheRestitutionIsNot) {
  ShapeSigns rigid = ball(4.11, 0.05);
  rigid.dynamics.bodyType = b3::kRigidBody;
  const auto body = describe(rigid);
  EXPECT_EQ(body.contact.form, Form::sphere);
  EXPECT_EQ(body.sound.material.name, "steel");
  EXPECT_FALSE(body.contact.restitution) << "the server does not tell it";
}

TEST(PybulletDescription, WhatHasNoKnownShapeFillsHalfTheBoxOfItsInertia) {
  ShapeSigns mesh = box(2.0, {0.1, 0.2, 0.3});
  mesh.halfBounds = Vec3(0.07, 0.12, 0.16);
  EXPECT_NEAR(volume(describe(mesh)), 0.003, 1e-12);
  mesh.halfBounds = std::nullopt;
  EXPECT_NEAR(volume(describe(mesh)), 0.003, 1e-12);
}

TEST(PybulletDescription, BoxPushesTheAirWithItsFacesUnlessItIsALink) {
  const ShapeSigns plate = box(1.0, {0.4, 0.4, 0.02});
  const auto body = describe(plate);
  ASSERT_TRUE(body.sound.shape);
  EXPECT_NEAR(body.sound.shape->volume, 0.0032, 1e-9);
  // A thin square plate with edge a that is hit flat drags 0.579 pi/4 a^3 of air (DNV-RP-C205,
  // table D-2).
  EXPECT_GT(body.sound.shape->addedVolume(2, 2), 0.579 * 0.25 * std::numbers::pi * 0.064);
  EXPECT_LT(body.sound.shape->addedVolume(0, 0), 0.1 * body.sound.shape->addedVolume(2, 2));
  EXPECT_GT(body.sound.inverseInertia(0, 0), 0.0);
  EXPECT_FALSE(describe(plate, false, true).sound.shape);
}

TEST(PybulletDescription, WhatNothingMovesIsOfConcreteAndSilent) {
  ShapeSigns isStatic = ball(3.0, 0.05);
  isStatic.dynamics.dynamicType = 1;
  ShapeSigns plane = box(0.0, Vec3::Constant(1e18));
  for (const BodyDescription& body : {describe(ball(0.0, 0.05)), describe(isStatic),
                                      describe(ball(3.0, 0.05), true), describe(plane)}) {
    EXPECT_TRUE(std::isinf(body.sound.mass));
    EXPECT_FALSE(body.contact.isMovable());
    EXPECT_EQ(body.sound.material.name, "concrete");
  }
}

}  // namespace
}  // namespace carom
