#include <cmath>
#include <limits>
#include <memory>
#include <string>

#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <btBulletCollisionCommon.h>
#include <gtest/gtest.h>

#include "bullet_bridge/shapes/shape_pair.h"
#include "tests/bullet_bridge/random_motion.h"
#include "tests/bullet_bridge/vectors.h"

// Tests that ShapePair sees the surface that Bullet's own dispatcher collides, whatever the shapes.
namespace carom {

using namespace bullet;

namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();

// Finds the deepest of all points that Bullet's algorithm for a pair reports.
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
  bool curved = false;
};

std::unique_ptr<btConvexHullShape> rock(unsigned seed) {
  auto hull = std::make_unique<btConvexHullShape>();
  Random random(seed);
  for (int i = 0; i < 14; ++i)
    hull->addPoint(bt(6.0 * random.direction()), false);
  hull->recalcLocalAabb();
  return hull;
}

// Bullet's GJK takes support points within a centimetre of each other for the same point, and
// stops: on curved surfaces it is accurate only to some millimetres, whatever their size. Therefore
// shapes and margins are large.
constexpr double kMargin = 0.3;
constexpr double kCurvedTolerance = 0.02;
constexpr double kTolerance = 1e-3;

std::vector<NamedShape> everyConvexShape() {
  std::vector<NamedShape> all;
  all.push_back({"sphere", std::make_unique<btSphereShape>(scalar(6)), true});
  all.push_back({"box", std::make_unique<btBoxShape>(bt(Vec3(6, 4, 8)))});
  all.push_back({"capsule x", std::make_unique<btCapsuleShapeX>(scalar(3), scalar(8)), true});
  all.push_back({"cylinder x", std::make_unique<btCylinderShapeX>(bt(Vec3(8, 4, 4))), true});
  all.push_back({"cylinder y", std::make_unique<btCylinderShape>(bt(Vec3(6, 2, 6))), true});
  all.push_back({"cylinder z", std::make_unique<btCylinderShapeZ>(bt(Vec3(6, 6, 4))), true});
  all.push_back({"cone x", std::make_unique<btConeShapeX>(scalar(6), scalar(10)), true});
  all.push_back({"cone z", std::make_unique<btConeShapeZ>(scalar(6), scalar(10)), true});
  all.push_back({"hull", rock(1)});
  auto scaled = rock(2);
  scaled->setLocalScaling(bt(Vec3(1.5, 0.5, 1.0)));
  all.push_back({"scaled hull", std::move(scaled)});
  auto featured = rock(3);
  featured->initializePolyhedralFeatures();
  all.push_back({"hull with features", std::move(featured)});
  auto featuredBox = std::make_unique<btBoxShape>(bt(Vec3(6, 4, 8)));
  featuredBox->initializePolyhedralFeatures();
  all.push_back({"box with features", std::move(featuredBox)});
  const btVector3 centres[] = {bt(Vec3(4, 0, 0)), bt(Vec3(-4, 0, 0)), bt(Vec3(0, 4, 0))};
  const btScalar radii[] = {scalar(4), scalar(3), scalar(2)};
  all.push_back({"spheres", std::make_unique<btMultiSphereShape>(centres, radii, 3), true});
  all.push_back({"triangle", std::make_unique<btTriangleShape>(bt(Vec3(6, 0, 2)),
                                                               bt(Vec3(-6, 2, 0)), centres[2])});
  all.push_back({"tetrahedron", std::make_unique<btBU_Simplex1to4>(centres[0], centres[1],
                                                                   centres[2], bt(Vec3(0, 0, 8)))});
  for (NamedShape& one : all)
    one.shape->setMargin(scalar(kMargin));
  return all;
}

// Compares at poses with a gap well within Bullet's reach, or with a little overlap for pairs that
// Bullet collides only then. Returns the number of poses at which Bullet found nothing though it
// visited the triangle: its GJK gives up on about one pose of a hundred against triangles.
int expectBulletAgrees(const NamedShape& one, const NamedShape& two, unsigned seed) {
  int missed = 0;
  const int type = one.shape->getShapeType();
  const bool wantsOverlap = type == two.shape->getShapeType() &&
                            (type == BOX_SHAPE_PROXYTYPE || type == SPHERE_SHAPE_PROXYTYPE);
  // A mesh is asked only for triangles that overlap the box around the other shape.
  const bool onMesh = one.shape->isConcave() != two.shape->isConcave() &&
                      !one.shape->isInfinite() && !two.shape->isInfinite();
  const double gap = wantsOverlap ? -0.001 : onMesh ? -0.01 : 0.01;
  const double tolerance = one.curved || two.curved ? kCurvedTolerance : kTolerance;
  Random random(seed);
  ShapePair pair;
  BulletNarrowphase bullet;
  for (int trial = 0; trial < 12; ++trial) {
    MovingShape body{one.shape.get(), {}}, other{two.shape.get(), {}};
    body.motion.orientation = random.orientation();
    other.motion.orientation = random.orientation();
    body.motion.centre.position = 40.0 * random.direction();
    EXPECT_TRUE(pair.set(body, other, 0.0, 100.0)) << one.name << " " << two.name;
    const Proximity apart = pair.proximityAt(0.0);
    if (!(apart.gap > 0.0)) continue;  // the pose is behind a plane
    body.motion.centre.position -= (apart.gap - gap) * apart.normal;
    EXPECT_TRUE(pair.set(body, other, 0.0, 100.0));
    const double found = pair.proximityAt(0.0).gap;
    EXPECT_NEAR(found, gap, wantsOverlap ? 1e-3 : 1e-6) << one.name << " " << two.name;
    const double depth = bullet.depth(body, other);
    if (onMesh && depth == kNone) {
      ++missed;
      continue;
    }
    EXPECT_NEAR(depth, found, tolerance) << one.name << " " << two.name;
  }
  return missed;
}

TEST(BulletSurface, ConvexShapesAreWhereBulletsNarrowphaseHasThem) {
  const auto shapes = everyConvexShape();
  unsigned seed = 100;
  for (const NamedShape& one : shapes)
    for (const NamedShape& two : shapes)
      expectBulletAgrees(one, two, ++seed);
}

TEST(BulletSurface, PlanesAreWhereBulletsNarrowphaseHasThem) {
  auto shapes = everyConvexShape();
  btBoxShape inner(bt(Vec3(6, 4, 8)));
  shapes.push_back({"scaled box", std::make_unique<btUniformScalingShape>(&inner, scalar(0.5))});
  const NamedShape plane{"plane",
                         std::make_unique<btStaticPlaneShape>(bt(Vec3(0.6, 0.8, 0.0)), scalar(-2))};
  unsigned seed = 500;
  for (const NamedShape& one : shapes) {
    expectBulletAgrees(one, plane, ++seed);
    expectBulletAgrees(plane, one, ++seed);
  }
}

TEST(BulletSurface, MeshesAreWhereBulletsNarrowphaseHasThem) {
  btTriangleMesh data;
  Random random(7);
  for (int i = 0; i < 12; ++i) {
    const Vec3 at = (8.0 * random.inCube());
    data.addTriangle(bt(at), bt(at + (8.0 * random.inCube())), bt(at + (8.0 * random.inCube())));
  }
  auto own = std::make_unique<btBvhTriangleMeshShape>(&data, true);
  own->setMargin(scalar(kMargin));
  btBvhTriangleMeshShape& unscaled = *own;
  const NamedShape mesh{"mesh", std::move(own)};
  auto scaled = std::make_unique<btScaledBvhTriangleMeshShape>(&unscaled, bt(Vec3(1.5, 0.5, 1.0)));
  scaled->setMargin(scalar(0.5 * kMargin));
  const NamedShape scaledMesh{"scaled mesh", std::move(scaled)};
  unsigned seed = 900;
  int missed = 0;
  for (const NamedShape& one : everyConvexShape()) {
    missed += expectBulletAgrees(one, mesh, ++seed);
    missed += expectBulletAgrees(scaledMesh, one, ++seed);
  }
  EXPECT_LT(missed, 15);  // of 360 poses
}

}  // namespace
}  // namespace carom
