#include <cmath>
#include <limits>
#include <memory>
#include <string>

#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <btBulletCollisionCommon.h>
#include <gtest/gtest.h>

#include "bullet_bridge/shape_pair.h"
#include "tests/bullet_bridge/random_motion.h"

// Whether ShapePair sees the surface that Bullet's own dispatcher collides, whatever the shapes.
namespace carom {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();

btScalar scalar(double value) {
  return static_cast<btScalar>(value);
}

btVector3 bt(const Vec3& v) {
  return {scalar(v.x()), scalar(v.y()), scalar(v.z())};
}

// The deepest point of all that Bullet's algorithm for a pair reports.
class BulletNarrowphase {
 public:
  double depth(const MovingShape& body, const MovingShape& other) {
    place(body, object_);
    place(other, otherObject_);
    const btCollisionObjectWrapper one(nullptr, body.shape, &object_, object_.getWorldTransform(),
                                       -1, -1);
    const btCollisionObjectWrapper two(nullptr, other.shape, &otherObject_,
                                       otherObject_.getWorldTransform(), -1, -1);
    Deepest deepest(&one, &two);
    btCollisionAlgorithm* algorithm =
        dispatcher_.findAlgorithm(&one, &two, nullptr, BT_CONTACT_POINT_ALGORITHMS);
    algorithm->processCollision(&one, &two, btDispatcherInfo(), &deepest);
    algorithm->~btCollisionAlgorithm();
    dispatcher_.freeCollisionAlgorithm(algorithm);
    return deepest.depth;
  }

 private:
  struct Deepest : btManifoldResult {
    using btManifoldResult::btManifoldResult;
    double depth = kNone;
    void addContactPoint(const btVector3&, const btVector3&, btScalar reported) override {
      depth = std::min(depth, static_cast<double>(reported));
    }
  };
  static void place(const MovingShape& from, btCollisionObject& object) {
    const Quat& turn = from.motion.orientation;
    btTransform pose;
    pose.setRotation(
        btQuaternion(scalar(turn.x()), scalar(turn.y()), scalar(turn.z()), scalar(turn.w())));
    pose.setOrigin(bt(from.motion.centre.position));
    object.setWorldTransform(pose);
    object.setCollisionShape(const_cast<btCollisionShape*>(from.shape));
  }

  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btCollisionObject object_, otherObject_;
};

struct NamedShape {
  std::string name;
  std::unique_ptr<btCollisionShape> shape;
};

std::unique_ptr<btConvexHullShape> rock(unsigned seed) {
  auto hull = std::make_unique<btConvexHullShape>();
  Random random(seed);
  for (int i = 0; i < 14; ++i)
    hull->addPoint(bt(0.3 * random.direction()), false);
  hull->recalcLocalAabb();
  return hull;
}

std::vector<NamedShape> everyConvexShape() {
  std::vector<NamedShape> all;
  all.push_back({"sphere", std::make_unique<btSphereShape>(scalar(0.3))});
  all.push_back({"box", std::make_unique<btBoxShape>(bt(Vec3(0.3, 0.2, 0.4)))});
  all.push_back({"capsule x", std::make_unique<btCapsuleShapeX>(scalar(0.15), scalar(0.4))});
  all.push_back({"cylinder x", std::make_unique<btCylinderShapeX>(bt(Vec3(0.4, 0.2, 0.2)))});
  all.push_back({"cylinder y", std::make_unique<btCylinderShape>(bt(Vec3(0.3, 0.1, 0.3)))});
  all.push_back({"cylinder z", std::make_unique<btCylinderShapeZ>(bt(Vec3(0.3, 0.3, 0.2)))});
  all.push_back({"cone x", std::make_unique<btConeShapeX>(scalar(0.3), scalar(0.5))});
  all.push_back({"cone z", std::make_unique<btConeShapeZ>(scalar(0.3), scalar(0.5))});
  all.push_back({"hull", rock(1)});
  auto scaled = rock(2);
  scaled->setLocalScaling(bt(Vec3(1.5, 0.5, 1.0)));
  all.push_back({"scaled hull", std::move(scaled)});
  auto featured = rock(3);
  featured->initializePolyhedralFeatures();
  all.push_back({"hull with features", std::move(featured)});
  auto featuredBox = std::make_unique<btBoxShape>(bt(Vec3(0.3, 0.2, 0.4)));
  featuredBox->initializePolyhedralFeatures();
  all.push_back({"box with features", std::move(featuredBox)});
  const btVector3 centres[] = {bt(Vec3(0.2, 0, 0)), bt(Vec3(-0.2, 0, 0)), bt(Vec3(0, 0.2, 0))};
  const btScalar radii[] = {scalar(0.2), scalar(0.15), scalar(0.1)};
  all.push_back({"spheres", std::make_unique<btMultiSphereShape>(centres, radii, 3)});
  all.push_back({"triangle", std::make_unique<btTriangleShape>(
                                 bt(Vec3(0.3, 0, 0.1)), bt(Vec3(-0.3, 0.1, 0)), centres[2])});
  auto simplex =
      std::make_unique<btBU_Simplex1to4>(centres[0], centres[1], centres[2], bt(Vec3(0, 0, 0.4)));
  all.push_back({"tetrahedron", std::move(simplex)});
  return all;
}

// Poses at which the shapes are `gap` apart along the normal; negative for a little overlap.
void expectBulletAgrees(const NamedShape& one, const NamedShape& two, double gap, double tolerance,
                        unsigned seed) {
  Random random(seed);
  ShapePair pair;
  BulletNarrowphase bullet;
  for (int trial = 0; trial < 12; ++trial) {
    MovingShape body{one.shape.get(), {}}, other{two.shape.get(), {}};
    body.motion.orientation = random.orientation();
    other.motion.orientation = random.orientation();
    body.motion.centre.position = 2.0 * random.direction();
    ASSERT_TRUE(pair.set(body, other, 0.0, 10.0)) << one.name << " " << two.name;
    const Proximity apart = pair.proximityAt(0.0);
    if (!(apart.gap > 0.0)) continue;  // a pose behind a plane
    body.motion.centre.position -= (apart.gap - gap) * apart.normal;
    ASSERT_TRUE(pair.set(body, other, 0.0, 10.0));
    const double found = pair.proximityAt(0.0).gap;
    EXPECT_NEAR(found, gap, 1e-9 + 0.05 * std::abs(gap)) << one.name << " " << two.name;
    EXPECT_NEAR(bullet.depth(body, other), found, tolerance) << one.name << " " << two.name;
  }
}

TEST(BulletSurface, ConvexShapesAreWhereBulletsNarrowphaseHasThem) {
  const auto shapes = everyConvexShape();
  unsigned seed = 100;
  for (const NamedShape& one : shapes)
    for (const NamedShape& two : shapes)
      expectBulletAgrees(one, two, -1e-3, 1e-4, ++seed);
}

TEST(BulletSurface, PlanesAreWhereBulletsNarrowphaseHasThem) {
  auto shapes = everyConvexShape();
  btBoxShape inner(bt(Vec3(0.3, 0.2, 0.4)));
  shapes.push_back({"scaled box", std::make_unique<btUniformScalingShape>(&inner, scalar(0.5))});
  const NamedShape plane{
      "plane", std::make_unique<btStaticPlaneShape>(bt(Vec3(0.6, 0.8, 0.0)), scalar(-0.1))};
  unsigned seed = 500;
  for (const NamedShape& one : shapes) {
    expectBulletAgrees(one, plane, 0.01, 1e-5, ++seed);
    expectBulletAgrees(plane, one, 0.01, 1e-5, ++seed);
  }
}

TEST(BulletSurface, MeshesAreWhereBulletsNarrowphaseHasThem) {
  btTriangleMesh data;
  Random random(7);
  for (int i = 0; i < 12; ++i) {
    const Vec3 at = random.vector(0.4);
    data.addTriangle(bt(at), bt(at + random.vector(0.4)), bt(at + random.vector(0.4)));
  }
  auto own = std::make_unique<btBvhTriangleMeshShape>(&data, true);
  own->setMargin(scalar(0.02));
  btBvhTriangleMeshShape& unscaled = *own;
  const NamedShape mesh{"mesh", std::move(own)};
  auto scaled = std::make_unique<btScaledBvhTriangleMeshShape>(&unscaled, bt(Vec3(1.5, 0.5, 1.0)));
  const NamedShape scaledMesh{"scaled mesh", std::move(scaled)};
  unsigned seed = 900;
  for (const NamedShape& one : everyConvexShape()) {
    expectBulletAgrees(one, mesh, 1e-3, 1e-4, ++seed);
    expectBulletAgrees(scaledMesh, one, 1e-3, 1e-4, ++seed);
  }
}

}  // namespace
}  // namespace carom
