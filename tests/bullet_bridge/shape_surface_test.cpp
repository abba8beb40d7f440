#include "bullet_bridge/shapes/shape_surface.h"

#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>
#include <gtest/gtest.h>

#include "bullet_bridge/shapes/surface_union.h"
#include "carom/audio/panel_radiator.h"
#include "tests/support/constants.h"

namespace carom {

using namespace bullet;

namespace {

using namespace test;

btTransform at(double x, double y, double z, const btQuaternion& turn = {0, 0, 0, 1}) {
  return btTransform(turn, btVector3(btScalar(x), btScalar(y), btScalar(z)));
}

void expectSolid(const SurfaceMesh& mesh, double volume, const Vec3& centroid,
                 double tolerance = 1e-5) {
  EXPECT_TRUE(closedSurface(mesh));
  EXPECT_NEAR(signedVolume(mesh), volume, tolerance * volume);
  EXPECT_LT((volumeCentroid(mesh) - centroid).norm(), tolerance * std::cbrt(volume) + 1e-12)
      << volumeCentroid(mesh).transpose();
}

// Expects a closed surface, oriented outward, with this volume (m^3) and centroid (m).
void expectSolid(const btCollisionShape& shape, double volume, const Vec3& centroid = Vec3::Zero(),
                 double tolerance = 1e-5) {
  const Result<SurfaceMesh> mesh = shapeSurface(shape);
  ASSERT_TRUE(mesh) << mesh.error().message;
  SCOPED_TRACE(shape.getName());
  expectSolid(*mesh, volume, centroid, tolerance);
}

std::string refusal(const btCollisionShape& shape) {
  const Result<SurfaceMesh> mesh = shapeSurface(shape);
  return mesh ? "" : mesh.error().message;
}

RigidRadiator radiatorOf(const btCollisionShape& shape) {
  const Result<SurfaceMesh> mesh = shapeSurface(shape);
  EXPECT_TRUE(mesh);
  const Result<RigidRadiator> radiator = panelRadiator(*mesh);
  EXPECT_TRUE(radiator) << (radiator ? "" : radiator.error().message);
  return radiator ? *radiator : RigidRadiator{};
}

void fillBox(btTriangleMesh& mesh, bool closed = true) {
  const btBoxShape box(btVector3(1, 2, 3));
  const SurfaceMesh surface = *shapeSurface(box);
  for (std::size_t t = closed ? 0 : 1; t < surface.triangles.size(); ++t) {
    std::array<btVector3, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& v = surface.vertices[surface.triangles[t][k]];
      corners[k] = btVector3(btScalar(v.x()), btScalar(v.y()), btScalar(v.z()));
    }
    mesh.addTriangle(corners[0], corners[1], corners[2]);
  }
}

TEST(ShapeSurface, BoxesAndRoundBodiesHaveTheVolumeOfTheirFormulas) {
  expectSolid(btBoxShape(btVector3(1, 2, 3)), 48.0);
  expectSolid(btSphereShape(btScalar(0.5)), kPi / 6.0);
  expectSolid(btCapsuleShape(btScalar(0.5), 2), kPi * 0.25 * (2.0 + 2.0 / 3.0));
  expectSolid(btCapsuleShapeX(btScalar(0.5), 2), kPi * 0.25 * (2.0 + 2.0 / 3.0));
  expectSolid(btCapsuleShapeZ(btScalar(0.5), 2), kPi * 0.25 * (2.0 + 2.0 / 3.0));
  expectSolid(btCapsuleShape(btScalar(0.5), 0), kPi / 6.0);
  expectSolid(btCylinderShape(btVector3(1, 3, 1)), 6.0 * kPi);
  expectSolid(btCylinderShapeX(btVector3(3, 1, 1)), 6.0 * kPi);
  expectSolid(btCylinderShapeZ(btVector3(1, 1, 3)), 6.0 * kPi);
  expectSolid(btConeShape(1, 4), 4.0 / 3.0 * kPi, {0, -1, 0});
  expectSolid(btConeShapeX(1, 4), 4.0 / 3.0 * kPi, {-1, 0, 0});
  expectSolid(btConeShapeZ(1, 4), 4.0 / 3.0 * kPi, {0, 0, -1});
}

TEST(ShapeSurface, RoundBodiesReachAsFarAsTheirShape) {
  const SurfaceMesh cylinder = *shapeSurface(btCylinderShapeX(btVector3(3, 1, 1)));
  for (const Vec3& vertex : cylinder.vertices) {
    EXPECT_LE(std::abs(vertex.x()), 3.0 + 1e-6);
    EXPECT_LE(std::hypot(vertex.y(), vertex.z()), 1.02);
  }
}

TEST(ShapeSurface, HullIsThatOfItsPointsWithoutMargin) {
  btConvexHullShape hull;
  for (const double x : {-1.0, 1.0, 0.0}) {
    for (const double y : {-2.0, 2.0, 0.0}) {
      for (const double z : {-3.0, 3.0, 0.0})
        hull.addPoint(btVector3(btScalar(x), btScalar(y), btScalar(z)));
    }
  }
  expectSolid(hull, 48.0);
  hull.setLocalScaling(btVector3(2, 1, 1));
  hull.setMargin(btScalar(0.3));
  expectSolid(hull, 96.0);
  const btBU_Simplex1to4 simplex(btVector3(0, 0, 0), btVector3(1, 0, 0), btVector3(0, 1, 0),
                                 btVector3(0, 0, 1));
  expectSolid(simplex, 1.0 / 6.0, Vec3::Constant(0.25));
}

TEST(ShapeSurface, MultiSphereIsTheHullOfItsSpheres) {
  const std::array<btVector3, 2> centres = {btVector3(0, -1, 0), btVector3(0, 1, 0)};
  const std::array<btScalar, 2> radii = {btScalar(0.5), btScalar(0.5)};
  const btMultiSphereShape capsule(centres.data(), radii.data(), 2);
  expectSolid(capsule, kPi * 0.25 * (2.0 + 2.0 / 3.0), Vec3::Zero(), 0.03);
}

TEST(ShapeSurface, UniformScalingScales) {
  btBoxShape box(btVector3(1, 2, 3));
  expectSolid(btUniformScalingShape(&box, btScalar(0.5)), 6.0);
}

TEST(ShapeSurface, ClosedMeshesAreTakenAsTheyAre) {
  btTriangleMesh triangles;
  fillBox(triangles);
  btBvhTriangleMeshShape fixed(&triangles, true);
  expectSolid(fixed, 48.0);
  expectSolid(btScaledBvhTriangleMeshShape(&fixed, btVector3(1, -2, 1)), 96.0);
  btGImpactMeshShape moving(&triangles);
  moving.updateBound();
  expectSolid(moving, 48.0);
  EXPECT_EQ(shapeSurface(moving)->triangles.size(), 12U);
}

TEST(ShapeSurface, RefusesWhatIsNotASolidBody) {
  btTriangleMesh triangles;
  fillBox(triangles, false);
  EXPECT_NE(refusal(btBvhTriangleMeshShape(&triangles, true)).find("open"), std::string::npos);
  EXPECT_NE(refusal(btStaticPlaneShape(btVector3(0, 1, 0), 0)).find("not a solid"),
            std::string::npos);
  EXPECT_NE(refusal(btConvexHullShape()).find("no volume"), std::string::npos);
  EXPECT_NE(refusal(btCompoundShape()).find("no volume"), std::string::npos);
  EXPECT_NE(refusal(btEmptyShape()).find("not a solid"), std::string::npos);
}

// ---- Compounds

TEST(ShapeSurface, TwoTouchingHalvesAreTheWholeBox) {
  btBoxShape half(btVector3(btScalar(0.5), 2, 3));
  btCompoundShape halves;
  halves.addChildShape(at(-0.5, 0, 0), &half);
  halves.addChildShape(at(0.5, 0, 0), &half);
  expectSolid(halves, 48.0);
  EXPECT_NEAR(surfaceArea(*shapeSurface(halves)), 88.0, 1e-4);
  const RigidRadiator whole = radiatorOf(btBoxShape(btVector3(1, 2, 3)));
  EXPECT_LT((radiatorOf(halves).addedVolume - whole.addedVolume).norm(),
            0.02 * whole.addedVolume.norm());
}

TEST(ShapeSurface, OverlappingAndShiftedBoxesAreTheirUnion) {
  btBoxShape box(btVector3(1, 1, 1));
  btCompoundShape overlap;  // an overlap of 1 x 2 x 2: coplanar on four sides
  overlap.addChildShape(at(0, 0, 0), &box);
  overlap.addChildShape(at(1, 0, 0), &box);
  expectSolid(overlap, 12.0, {0.5, 0, 0});
  btCompoundShape corner;  // an overlap of 1 x 1 x 1
  corner.addChildShape(at(0, 0, 0), &box);
  corner.addChildShape(at(1, 1, 1), &box);
  expectSolid(corner, 15.0, Vec3::Constant(0.5));
  EXPECT_NEAR(surfaceArea(*shapeSurface(corner)), 42.0, 1e-4);
  btCompoundShape stair;  // touching, shifted: no T-junction may stay open
  stair.addChildShape(at(0, 0, 0), &box);
  stair.addChildShape(at(2, 0.7, 0.3), &box);
  expectSolid(stair, 16.0, {1, 0.35, 0.15});
}

TEST(ShapeSurface, ACrossOfThreeBarsIsTheirUnion) {
  btCompoundShape cross;
  btBoxShape x(btVector3(3, 1, 1));
  btBoxShape y(btVector3(1, 3, 1));
  btBoxShape z(btVector3(1, 1, 3));
  for (btBoxShape* bar : {&x, &y, &z})
    cross.addChildShape(at(0, 0, 0), bar);
  expectSolid(cross, 3 * 24.0 - 2 * 8.0);
  EXPECT_NEAR(surfaceArea(*shapeSurface(cross)), 6 * (4.0 + 4 * 4.0), 1e-4);
}

TEST(ShapeSurface, TurnedBoxesAreTheirUnion) {
  // The union of a square prism and the same one turned by 45 degrees is an eight-pointed star, of
  // area 4 (4 - 2 sqrt 2) for squares of side 2.
  btBoxShape box(btVector3(1, 1, 1));
  btCompoundShape star;
  star.addChildShape(at(0, 0, 0), &box);
  star.addChildShape(at(0, 0, 0, btQuaternion(btVector3(0, 0, 1), SIMD_PI / 4)), &box);
  const double overlap = 8.0 * std::tan(kPi / 8.0);
  expectSolid(star, 2.0 * (8.0 - overlap), Vec3::Zero(), 1e-4);
}

// Where every edge was held against every vertex, this took half a minute.
TEST(ShapeSurface, ALongRowOfOverlappingPartsIsTheirUnion) {
  constexpr int kParts = 300;
  btCompoundShape bar;
  btBoxShape box(btVector3(1, 1, 1));
  for (int part = 0; part < kParts; ++part)
    bar.addChildShape(at(part, 0, 0), &box);
  expectSolid(bar, 4.0 * (kParts + 1), {0.5 * (kParts - 1), 0, 0}, 1e-3);
  btCompoundShape chain;
  btCapsuleShapeX link(btScalar(0.5), 2);
  for (int part = 0; part < 100; ++part)
    chain.addChildShape(at(2 * part, 0, 0), &link);
  const Result<SurfaceMesh> surface = shapeSurface(chain);
  ASSERT_TRUE(surface);
  EXPECT_NEAR(signedVolume(*surface), kPi * 0.25 * (200.0 + 2.0 / 3.0), 0.01 * kPi * 0.25 * 200.0);
}

TEST(ShapeSurface, ADumbbellAndNestedCompoundsAreTheirUnion) {
  btSphereShape ball(1);
  btCylinderShapeX bar(btVector3(3, btScalar(0.3), btScalar(0.3)));
  btCompoundShape ends;
  ends.addChildShape(at(-3, 0, 0), &ball);
  ends.addChildShape(at(3, 0, 0), &ball);
  btCompoundShape dumbbell;
  dumbbell.addChildShape(at(0, 1, 0), &ends);
  dumbbell.addChildShape(at(0, 1, 0), &bar);
  // Each ball hides 1 of the bar's length, less the cap; the rest of the bar adds to the volume.
  const double cap = 1.0 - std::sqrt(1.0 - 0.09);
  const double lens = kPi * cap * cap * (3.0 - cap) / 3.0;
  const double volume = 2 * 4.0 / 3.0 * kPi + kPi * 0.09 * (4.0 + 2.0 * cap) - 2 * lens;
  expectSolid(dumbbell, volume, {0, 1, 0}, 0.01);
}

TEST(ShapeSurface, SeparateChildrenAndAContainedOneAddUpAndVanish) {
  btBoxShape box(btVector3(1, 1, 1));
  btBoxShape small(btVector3(btScalar(0.5), btScalar(0.5), btScalar(0.5)));
  btCompoundShape compound;
  compound.addChildShape(at(-2, 0, 0), &box);
  compound.addChildShape(at(2, 0, 0), &box);
  compound.addChildShape(at(2, 0, 0), &small);
  compound.addChildShape(at(-2, 0, 0), &box);  // a copy of the first child
  expectSolid(compound, 16.0);
}

// Tests fifty compounds of turned boxes. Where cutting fails the hull replaces the union, so that
// the result is always closed, holds no more than the hull, and no less than the largest child.
TEST(ShapeSurface, RandomCompoundsAreClosedAndWithinTheirBounds) {
  unsigned state = 1;
  const auto random = [&state](double low, double high) {
    state = state * 1664525U + 1013904223U;
    return low + (high - low) * (state >> 8U) / double(1U << 24U);
  };
  for (int trial = 0; trial < 50; ++trial) {
    btBoxShape box(btVector3(1, btScalar(0.5), btScalar(0.3)));
    btCompoundShape compound;
    for (int child = 0; child < 4; ++child) {
      const btQuaternion turn(btVector3(btScalar(random(-1, 1)), btScalar(random(-1, 1)), 1),
                              btScalar(random(0, 3)));
      compound.addChildShape(
          at(random(-0.7, 0.7), random(-0.7, 0.7), random(-0.7, 0.7), turn.normalized()), &box);
    }
    const Result<SurfaceMesh> mesh = shapeSurface(compound);
    ASSERT_TRUE(mesh);
    EXPECT_TRUE(closedSurface(*mesh));
    EXPECT_GE(signedVolume(*mesh), 1.2 - 1e-4);
    // The union's volume is estimated by random points in the bounding box: the share that lies in
    // any child.
    btVector3 low;
    btVector3 high;
    compound.getAabb(btTransform::getIdentity(), low, high);
    int inside = 0;
    const int shots = 4000;
    for (int shot = 0; shot < shots; ++shot) {
      const btVector3 point(btScalar(random(double(low.x()), double(high.x()))),
                            btScalar(random(double(low.y()), double(high.y()))),
                            btScalar(random(double(low.z()), double(high.z()))));
      for (int child = 0; child < 4; ++child) {
        const btVector3 local = compound.getChildTransform(child).invXform(point);
        if (std::abs(double(local.x())) < 1 && std::abs(double(local.y())) < 0.5 &&
            std::abs(double(local.z())) < 0.3) {
          ++inside;
          break;
        }
      }
    }
    const btVector3 size = high - low;
    const double bounds = double(size.x()) * double(size.y()) * double(size.z());
    const double share = double(inside) / shots;
    const double sigma = bounds * std::sqrt(share * (1.0 - share) / shots);
    EXPECT_NEAR(signedVolume(*mesh), share * bounds, 5.0 * sigma) << trial;
  }
}

TEST(ShapeSurface, AMeshChildHasToStandApart) {
  btTriangleMesh triangles;
  fillBox(triangles);
  btGImpactMeshShape mesh(&triangles);
  mesh.updateBound();
  btBoxShape box(btVector3(1, 1, 1));
  btCompoundShape touching;
  touching.addChildShape(at(0, 0, 0), &mesh);
  touching.addChildShape(at(1, 0, 0), &box);
  EXPECT_NE(refusal(touching).find("may touch"), std::string::npos);
  btCompoundShape free;
  free.addChildShape(at(0, 0, 0), &mesh);
  free.addChildShape(at(5, 0, 0), &box);
  free.addChildShape(at(-5, 0, 0), &box);
  expectSolid(free, 64.0);
}

// ---- Radiators of Bullet's shapes

TEST(ShapeSurface, RadiatorsOfBulletShapesAreThoseOfTheirForms) {
  const RigidRadiator sphere = radiatorOf(btSphereShape(btScalar(0.5)));
  EXPECT_NEAR(sphere.radius(), 0.5, 0.002);
  const RigidRadiator cube =
      radiatorOf(btBoxShape(btVector3(btScalar(0.5), btScalar(0.5), btScalar(0.5))));
  EXPECT_NEAR(cube.addedVolume(0, 0), 0.638, 0.005);
  // The added volume of a long capsule across its axis is nearly that of a cylinder in plane flow,
  // its own volume.
  const RigidRadiator capsule = radiatorOf(btCapsuleShape(1, 20));
  EXPECT_NEAR(capsule.addedVolume(0, 0) / capsule.volume, 0.98, 0.04);
  EXPECT_NEAR(capsule.addedVolume(0, 0) / capsule.addedVolume(2, 2), 1.0, 0.01);
  // The added volume of a coin is that of a disc: 8/3 a^3.
  const RigidRadiator coin = radiatorOf(btCylinderShape(btVector3(1, btScalar(0.02), 1)));
  EXPECT_NEAR(coin.addedVolume(1, 1) / (8.0 / 3.0), 1.03, 0.05);
}

}  // namespace
}  // namespace carom
