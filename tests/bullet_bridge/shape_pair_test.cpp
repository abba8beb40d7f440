#include "bullet_bridge/shapes/shape_pair.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>

#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <gtest/gtest.h>

#include "bullet_bridge/bodies/body_tracker.h"
#include "bullet_bridge/shapes/separation_bound.h"
#include "tests/bullet_bridge/nearest_by_hand.h"
#include "tests/bullet_bridge/random_motion.h"
#include "tests/bullet_bridge/vectors.h"
#include "tests/support/constants.h"
#include "tests/support/no_alloc_scope.h"

namespace carom {

using namespace bullet;

namespace {

using namespace test;

using by_hand::Points;
using by_hand::RoundSet;
using by_hand::searchedTouch;

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kSubstep = 1.0 / 60.0;
constexpr double kGrazing = 1e-9;  // s; a touch that is shorter need not be found

std::vector<std::unique_ptr<btConvexShape>> convexShapes() {
  std::vector<std::unique_ptr<btConvexShape>> shapes;
  shapes.push_back(std::make_unique<btSphereShape>(btScalar(0.05)));
  shapes.push_back(
      std::make_unique<btBoxShape>(btVector3(scalar(0.05), scalar(0.03), scalar(0.08))));
  shapes.push_back(std::make_unique<btCapsuleShapeX>(btScalar(0.02), btScalar(0.1)));
  shapes.push_back(
      std::make_unique<btCylinderShape>(btVector3(scalar(0.05), scalar(0.03), scalar(0.05))));
  shapes.push_back(
      std::make_unique<btCylinderShapeZ>(btVector3(scalar(0.05), scalar(0.05), scalar(0.01))));
  shapes.push_back(std::make_unique<btConeShape>(btScalar(0.05), btScalar(0.1)));
  auto hull = std::make_unique<btConvexHullShape>();
  Random random(77);
  for (int i = 0; i < 20; ++i) {
    hull->addPoint(bt(0.06 * random.direction()));
  }
  hull->setMargin(btScalar(0.002));
  shapes.push_back(std::move(hull));
  return shapes;
}

TEST(ShapePair, EveryPairOfConvexShapesHasGapZeroAtItsTouchAndIsApartBefore) {
  const auto shapes = convexShapes();
  Random random(1);
  ShapePair pair, swapped;
  int touches = 0;
  for (const auto& shape : shapes) {
    for (const auto& against : shapes) {
      for (int trial = 0; trial < 50; ++trial) {
        const MovingShape body{shape.get(), tumbling(random, 0.3, 10.0, 30.0)};
        MovingShape other{against.get(), {}};
        other.motion.orientation = random.orientation();
        other.motion.angularVelocity = (20.0 * random.inCube());
        const double horizon = 1.0 / 30.0;
        ASSERT_TRUE(pair.set(body, other, horizon, 0.01));
        ASSERT_TRUE(swapped.set(other, body, horizon, 0.01));
        const double touch = pair.impactTime();
        EXPECT_NEAR(std::min(swapped.impactTime(), 1.0), std::min(touch, 1.0), 1e-9);
        const double until = std::min(touch, horizon);
        for (int i = 0; i < 20; ++i) {
          EXPECT_GT(pair.proximityAt(until * i / 20.0).gap, 0.0);
        }
        if (touch == kNever) continue;
        ++touches;
        EXPECT_NEAR(pair.proximityAt(touch).gap, 0.0, 1e-9)
            << shape->getName() << " " << against->getName();
        EXPECT_LT(pair.proximityAt(touch + 1e-7).gap, 0.0);
      }
    }
  }
  EXPECT_GT(touches, 500);
}

struct Times {
  double found = kNever;
  double expected = kNever;
};

// Counts the touches that had to be found, after checking that the brute force finds each at the
// same time.
class Tally {
 public:
  void compare(const Times& times, double tolerance = 1e-9) {
    if (times.expected == kNever) {
      EXPECT_EQ(times.found, kNever);
      return;
    }
    ++touches_;
    EXPECT_NEAR(times.found, times.expected, tolerance);
  }
  int touches() const { return touches_; }

 private:
  int touches_ = 0;
};

Times timesOf(ShapePair& pair, const MovingShape& body, const MovingShape& other) {
  EXPECT_TRUE(pair.set(body, other, kSubstep, 1.0));
  return {pair.impactTime(), kNever};
}

Points placed(Points points, const Pose& pose) {
  for (Vec3& point : points)
    point = pose.toWorld(point);
  return points;
}

double lowest(const Points& points) {
  double least = kNever;
  for (const Vec3& point : points)
    least = std::min(least, point.y());
  return least;
}

// A motion that falls, tumbling, onto the plane y = 0 and reaches it within the substep, or just
// not.
RigidMotion falling(Random& random, double size) {
  RigidMotion motion = tumbling(random, 1.0, 1.0, 40.0);
  motion.centre.position = (1.0 * random.inCube());
  motion.centre.position.y() = random.between(1.01, 1.8) * size;
  motion.centre.velocity = Vec3(1.0, -random.between(0.2, 60.0 * size), 2.0);
  return motion;
}

Points cornersOf(const btConvexHullShape& hull) {
  Points corners;
  for (int i = 0; i < hull.getNumPoints(); ++i)
    corners.push_back(
        toVec3(hull.getUnscaledPoints()[i]).cwiseProduct(toVec3(hull.getLocalScaling())));
  return corners;
}

TEST(ShapePair, TumblingShapesTouchAPlaneWhenTheirLowestPointDoes) {
  const btStaticPlaneShape plane(btVector3(0, 1, 0), scalar(0));
  btBoxShape box(bt(Vec3(0.05, 0.03, 0.08)));
  const btCapsuleShape capsule(scalar(0.02), scalar(0.1));
  const btCylinderShape cylinder(bt(Vec3(0.05, 0.03, 0.05)));
  const btConeShape cone(scalar(0.05), scalar(0.1));
  btConvexHullShape hull;
  Random random(21);
  for (int i = 0; i < 30; ++i)
    hull.addPoint(bt(0.06 * random.direction()));
  hull.setLocalScaling(btVector3(1, scalar(1.5), 1));

  // The gaps include Bullet's margins where Bullet rounds the shape by them.
  const auto boxGap = [&](const Pose& pose) {
    return lowest(by_hand::boxCorners(toVec3(box.getHalfExtentsWithMargin()), pose));
  };
  const auto capsuleGap = [&](const Pose& pose) {
    const double half = static_cast<double>(capsule.getHalfHeight());
    return lowest({pose.toWorld(Vec3(0, half, 0)), pose.toWorld(Vec3(0, -half, 0))}) -
           static_cast<double>(capsule.getRadius());
  };
  const auto cylinderGap = [&](const Pose& pose) {
    const Vec3 half = toVec3(cylinder.getHalfExtentsWithoutMargin());
    const double tilt = pose.rotation(1, 1);  // cosine of the axis' angle to the vertical
    return pose.position.y() - half.y() * std::abs(tilt) - half.x() * std::sqrt(1.0 - tilt * tilt) -
           static_cast<double>(cylinder.getMargin());
  };
  const auto coneGap = [&](const Pose& pose) {
    const double half = 0.5 * static_cast<double>(cone.getHeight());
    const double tilt = pose.rotation(1, 1);
    const double rim =
        -half * tilt - static_cast<double>(cone.getRadius()) * std::sqrt(1.0 - tilt * tilt);
    return pose.position.y() + std::min(half * tilt, rim) - static_cast<double>(cone.getMargin());
  };
  const auto hullGap = [&](const Pose& pose) {
    return lowest(placed(cornersOf(hull), pose)) - static_cast<double>(hull.getMargin());
  };

  ShapePair pair;
  const auto check = [&](const btConvexShape& shape, double size, auto gapOf) {
    Tally tally;
    for (int trial = 0; trial < 80; ++trial) {
      const RigidMotion motion = falling(random, size);
      if (gapOf(motion.poseAt(0.0)) <= 0.0) continue;
      Times times = timesOf(pair, {&shape, motion}, {&plane, {}});
      times.expected = searchedTouch([&](double s) { return gapOf(motion.poseAt(s)); }, kSubstep,
                                     2000, times.found + kGrazing);
      tally.compare(times);
      EXPECT_EQ(timesOf(pair, {&plane, {}}, {&shape, motion}).found, times.found);
      EXPECT_NEAR(pair.proximityAt(0.0).gap, gapOf(motion.poseAt(0.0)), 1e-15);
    }
    EXPECT_GT(tally.touches(), 20);
  };
  check(box, 0.1, boxGap);
  check(capsule, 0.07, capsuleGap);
  check(cylinder, 0.06, cylinderGap);
  check(cone, 0.1, coneGap);
  check(hull, 0.12, hullGap);
}

TEST(ShapePair, ATurningPlaneIsTouchedWhenTheLowestCornerGetsToIt) {
  const btStaticPlaneShape plane(btVector3(0, 1, 0), scalar(0));
  const btBoxShape box(bt(Vec3(0.05, 0.03, 0.08)));
  Random random(22);
  ShapePair pair;
  Tally tally;
  for (int trial = 0; trial < 60; ++trial) {
    const RigidMotion motion = falling(random, 0.1);
    RigidMotion tilting;
    tilting.centre.velocity = (3.0 * random.inCube());
    tilting.angularVelocity = (5.0 * random.inCube());
    const auto gap = [&](double s) {
      Points corners =
          by_hand::boxCorners(toVec3(box.getHalfExtentsWithMargin()), motion.poseAt(s));
      for (Vec3& corner : corners)
        corner = tilting.poseAt(s).toLocal(corner);
      return lowest(corners);
    };
    if (gap(0.0) <= 0.0) continue;
    Times times = timesOf(pair, {&box, motion}, {&plane, tilting});
    times.expected = searchedTouch(gap, kSubstep, 2000, times.found + kGrazing);
    tally.compare(times);
  }
  EXPECT_GT(tally.touches(), 20);
}

TEST(ShapePair, BoxesAndHullsTouchWhenCornersEdgesOrFacesDo) {
  const btBoxShape box(bt(Vec3(0.05, 0.03, 0.08)));
  const btBoxShape small(bt(Vec3(0.02, 0.05, 0.03)));
  btConvexHullShape hull;
  Random random(23);
  for (int i = 0; i < 6; ++i)
    hull.addPoint(bt(0.06 * random.direction()));
  hull.setMargin(scalar(0.003));
  ShapePair pair;
  Tally boxes, hulls;
  for (int trial = 0; trial < 50; ++trial) {
    const RigidMotion motion = tumbling(random, 0.15, 8.0, 60.0);
    RigidMotion other;
    other.orientation = random.orientation();
    other.angularVelocity = (60.0 * random.inCube());
    // A box is sharp against a box, and rounded by its margin against a hull.
    const auto boxGap = [&](double s) {
      return by_hand::hullHullOrOverlap(
          by_hand::boxCorners(toVec3(small.getHalfExtentsWithMargin()), motion.poseAt(s)),
          by_hand::boxCorners(toVec3(box.getHalfExtentsWithMargin()), other.poseAt(s)));
    };
    const auto hullGap = [&](double s) {
      return by_hand::hullHull(
                 placed(cornersOf(hull), motion.poseAt(s)),
                 by_hand::boxCorners(toVec3(box.getHalfExtentsWithoutMargin()), other.poseAt(s))) -
             static_cast<double>(hull.getMargin()) - static_cast<double>(box.getMargin());
    };
    if (boxGap(0.0) > 0.0) {
      Times times = timesOf(pair, {&small, motion}, {&box, other});
      EXPECT_NEAR(pair.proximityAt(0.0).gap, boxGap(0.0), 1e-15);
      times.expected = searchedTouch(boxGap, kSubstep, 150, times.found + kGrazing);
      boxes.compare(times);
    }
    if (hullGap(0.0) > 0.0) {
      Times times = timesOf(pair, {&hull, motion}, {&box, other});
      EXPECT_NEAR(pair.proximityAt(0.0).gap, hullGap(0.0), 1e-15);
      times.expected = searchedTouch(hullGap, kSubstep, 150, times.found + kGrazing);
      hulls.compare(times);
    }
  }
  EXPECT_GT(boxes.touches(), 20);
  EXPECT_GT(hulls.touches(), 20);
}

struct MovingBox {
  btBoxShape shape;
  ConvexPiece piece;
  RigidMotion motion;

  explicit MovingBox(const Vec3& half)
      : shape(bt(half)), piece(ConvexPiece::from(shape)->withSharpEdges()) {}
  PlacedPiece placed() const {
    return {&piece, motion.poseAt(0.0).rotation, motion.centre.position};
  }
  Points cornersAt(double s) const {
    return by_hand::boxCorners(toVec3(shape.getHalfExtentsWithMargin()), motion.poseAt(s));
  }
};

// Time (s) until which two boxes are surely apart along the normal of their distance at the start,
// which turns.
double clearUntil(const MovingBox& body, const MovingBox& other, const Vec3& turning) {
  const Vec3 normal = coreDistance(body.placed(), other.placed(), Vec3::UnitY()).normal;
  const auto sideOf = [](const MovingBox& box) {
    SeparationBound::Side side{box.placed(), box.motion.angularVelocity};
    side.piece.position.setZero();
    return side;
  };
  const SeparationBound::Pieces pieces{sideOf(body), sideOf(other),
                                       body.motion.centre - other.motion.centre};
  return SeparationBound(pieces, {normal, turning}, kSubstep).clearTime(kSubstep).until;
}

TEST(SeparationBound, ADirectionThatTurnsIsClearNoLongerThanTheBoxesAre) {
  MovingBox body(Vec3(0.02, 0.05, 0.03));
  MovingBox other(Vec3(0.05, 0.03, 0.08));
  Random random(25);
  int compared = 0;
  for (int trial = 0; trial < 600; ++trial) {
    body.motion = tumbling(random, 0.14, 8.0, 60.0);
    other.motion.orientation = random.orientation();
    other.motion.angularVelocity = 60.0 * random.inCube();
    other.motion.centre.velocity = 2.0 * random.inCube();
    const auto gap = [&](double s) {
      return by_hand::hullHullOrOverlap(body.cornersAt(s), other.cornersAt(s));
    };
    if (!(gap(0.0) > 0.0)) continue;
    const std::array<Vec3, 4> turnings{Vec3::Zero(), body.motion.angularVelocity,
                                       other.motion.angularVelocity, 60.0 * random.inCube()};
    const double until = clearUntil(body, other, turnings[static_cast<std::size_t>(trial % 4)]);
    if (until > 0.0) ++compared;
    for (int i = 0; i <= 20; ++i)
      EXPECT_GT(gap(until * i / 20.0), -1e-12);
  }
  EXPECT_GT(compared, 300);
}

TEST(SeparationBound, BoxesThatTurnTogetherAMicrometreApartStayClearTenTimesAsLong) {
  MovingBox body(Vec3(0.02, 0.05, 0.03));
  MovingBox other(Vec3(0.05, 0.03, 0.08));
  other.motion.angularVelocity = Vec3(3.0, 1.0, 0.0);
  body.motion.angularVelocity = other.motion.angularVelocity;
  body.motion.centre.position = Vec3(0.01, 0.08 + 1e-6, 0.02);
  body.motion.centre.velocity = other.motion.angularVelocity.cross(body.motion.centre.position);
  EXPECT_GT(clearUntil(body, other, other.motion.angularVelocity),
            10.0 * clearUntil(body, other, Vec3::Zero()));
}

// The edges cross at right angles; each body turns about the axis along the other's edge, so that
// the normal has to turn with both.
TEST(SeparationBound, CrossedEdgesThatTurnAMicrometreApartStayClearFiveTimesAsLong) {
  MovingBox body(Vec3(0.05, 0.02, 0.02));
  MovingBox other(Vec3(0.02, 0.02, 0.05));
  const double quarter = std::numbers::pi / 4.0;
  body.motion.orientation = Quat(Eigen::AngleAxisd(quarter, Vec3::UnitX()));
  other.motion.orientation = Quat(Eigen::AngleAxisd(quarter, Vec3::UnitZ()));
  const double height = 2.0 * toVec3(body.shape.getHalfExtentsWithMargin()).y() * std::sqrt(2.0);
  body.motion.centre.position = Vec3(0.0, height + 1e-6, 0.0);
  body.motion.angularVelocity = Vec3(0.0, 0.0, 3.0);
  other.motion.angularVelocity = Vec3(3.0, 0.0, 0.0);
  const double longest = std::max({clearUntil(body, other, Vec3::Zero()),
                                   clearUntil(body, other, body.motion.angularVelocity),
                                   clearUntil(body, other, other.motion.angularVelocity)});
  EXPECT_GT(clearUntil(body, other, Vec3(3.0, 0.0, 3.0)), 5.0 * longest);
}

// A cylinder, cone, capsule or box, as a set with a projection and a margin.
struct Rounded {
  std::unique_ptr<btConvexShape> shape;
  RoundSet set;
  double margin = 0.0;
};

std::vector<Rounded> roundedShapes() {
  std::vector<Rounded> all(4);
  auto cylinder = std::make_unique<btCylinderShape>(bt(Vec3(0.05, 0.03, 0.05)));
  const Vec3 core = toVec3(cylinder->getHalfExtentsWithoutMargin());
  all[0].set = {RoundSet::Kind::cylinder, core.x(), core.y(), core};
  all[0].shape = std::move(cylinder);
  auto cone = std::make_unique<btConeShape>(scalar(0.05), scalar(0.125));
  cone->setMargin(scalar(0.002));
  all[1].set = {RoundSet::Kind::cone, static_cast<double>(cone->getRadius()), 0.0625, core};
  all[1].shape = std::move(cone);
  auto capsule = std::make_unique<btCapsuleShape>(scalar(0.02), scalar(0.125));
  all[2].set = {RoundSet::Kind::segment, 0.0, 0.0625, core};
  all[2].shape = std::move(capsule);
  auto box = std::make_unique<btBoxShape>(bt(Vec3(0.05, 0.03, 0.04)));
  all[3].set = {RoundSet::Kind::box, 0.0, 0.0, toVec3(box->getHalfExtentsWithoutMargin())};
  all[3].shape = std::move(box);
  for (Rounded& one : all)
    one.margin = static_cast<double>(one.shape->getMargin());
  return all;
}

TEST(ShapePair, RoundShapesTouchEachOtherWhenTheirProjectionsMeet) {
  const std::vector<Rounded> shapes = roundedShapes();
  Random random(24);
  ShapePair pair;
  Tally tally;
  for (const Rounded& one : shapes) {
    for (const Rounded& two : shapes) {
      if (&one == &two && &one == &shapes[3]) continue;  // boxes are sharp to each other
      for (int trial = 0; trial < 4; ++trial) {
        const RigidMotion motion = tumbling(random, 0.14, 8.0, 50.0);
        RigidMotion other;
        other.orientation = random.orientation();
        other.angularVelocity = (50.0 * random.inCube());
        Vec3 start = motion.centre.position;
        const auto gap = [&](double s) {
          return by_hand::roundRound(one.set, motion.poseAt(s), two.set, other.poseAt(s), start,
                                     100000) -
                 one.margin - two.margin;
        };
        if (gap(0.0) <= 0.0) continue;
        Times times = timesOf(pair, {one.shape.get(), motion}, {two.shape.get(), other});
        EXPECT_NEAR(pair.proximityAt(0.0).gap, gap(0.0), 1e-11);
        times.expected = searchedTouch(gap, kSubstep, 100, times.found + kGrazing);
        tally.compare(times, 2e-8);  // the accuracy of the projections
      }
    }
  }
  EXPECT_GT(tally.touches(), 20);
}

// The gap is the least over the parts, each at its own place on the body.
TEST(ShapePair, CompoundsTouchWithWhicheverChildComesFirst) {
  btBoxShape seat(bt(Vec3(0.1, 0.01, 0.1)));
  btBoxShape leg(bt(Vec3(0.01, 0.06, 0.01)));
  btCompoundShape legs, chair;
  Random random(25);
  std::vector<std::pair<Vec3, Pose>> parts;  // half extents and place
  const auto add = [&](btCompoundShape& to, btBoxShape& shape, const Vec3& at, const Pose& of) {
    btTransform pose;
    pose.setIdentity();
    pose.setOrigin(bt(at));
    to.addChildShape(pose, &shape);
    const Vec3 offset = toVec3(pose.getOrigin());
    parts.emplace_back(toVec3(shape.getHalfExtentsWithMargin()),
                       Pose{of.toWorld(offset), of.rotation});
  };
  btTransform tilted;
  tilted.setIdentity();
  tilted.setBasis(btMatrix3x3(0, -1, 0, 1, 0, 0, 0, 0, 1));  // quarter turns are exact
  tilted.setOrigin(btVector3(0, scalar(0.0625), 0));
  Pose nested;
  nested.position = toVec3(tilted.getOrigin());
  nested.rotation << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  for (const double x : {-0.09, 0.09})
    for (const double z : {-0.09, 0.09})
      add(legs, leg, Vec3(x, 0.0, z), nested);
  chair.addChildShape(tilted, &legs);
  add(chair, seat, Vec3(0, -0.01, 0), {});

  const btStaticPlaneShape plane(btVector3(0, 1, 0), scalar(0));
  const btBoxShape block(bt(Vec3(0.05, 0.03, 0.08)));
  ShapePair pair;
  Tally onPlane, onBox;
  const auto partCorners = [&](const std::pair<Vec3, Pose>& part, const Pose& pose) {
    return placed(by_hand::boxCorners(part.first, part.second), pose);
  };
  for (int trial = 0; trial < 40; ++trial) {
    const RigidMotion fall = falling(random, 0.2);
    const auto planeGap = [&](double s) {
      double least = kNever;
      for (const auto& part : parts)
        least = std::min(least, lowest(partCorners(part, fall.poseAt(s))));
      return least;
    };
    if (planeGap(0.0) > 0.0) {
      Times times = timesOf(pair, {&chair, fall}, {&plane, {}});
      EXPECT_NEAR(pair.proximityAt(0.0).gap, planeGap(0.0), 1e-15);
      times.expected = searchedTouch(planeGap, kSubstep, 1000, times.found + kGrazing);
      onPlane.compare(times);
    }
    const RigidMotion flight = tumbling(random, 0.3, 12.0, 40.0);
    const auto boxGap = [&](double s) {
      const Points corners = by_hand::boxCorners(toVec3(block.getHalfExtentsWithMargin()), {});
      double least = kNever;
      for (const auto& part : parts) {
        const Vec3 centre = flight.poseAt(s).toWorld(part.second.position);
        if (centre.norm() - part.first.norm() - toVec3(block.getHalfExtentsWithMargin()).norm() >
            least) {
          continue;
        }
        least = std::min(least,
                         by_hand::hullHullOrOverlap(partCorners(part, flight.poseAt(s)), corners));
      }
      return least;
    };
    if (boxGap(0.0) <= 0.0) continue;
    Times times = timesOf(pair, {&chair, flight}, {&block, {}});
    times.expected = searchedTouch(boxGap, kSubstep, 40, times.found + kGrazing);
    onBox.compare(times);
    const double swapped = timesOf(pair, {&block, {}}, {&chair, flight}).found;
    EXPECT_NEAR(std::min(swapped, 1.0), std::min(times.found, 1.0), 1e-10);
  }
  EXPECT_GT(onPlane.touches(), 5);
  EXPECT_GT(onBox.touches(), 10);
}

struct Triangles : btTriangleCallback {
  std::vector<Points> all;
  explicit Triangles(const btConcaveShape& shape) {
    const btScalar far = scalar(1e3);
    shape.processAllTriangles(this, btVector3(-far, -far, -far), btVector3(far, far, far));
  }
  void processTriangle(btVector3* triangle, int, int) override {
    all.push_back({toVec3(triangle[0]), toVec3(triangle[1]), toVec3(triangle[2])});
  }
};

// A mesh of hills.
std::unique_ptr<btTriangleMesh> hills() {
  auto mesh = std::make_unique<btTriangleMesh>();
  Random random(26);
  constexpr int kCells = 5;
  std::array<std::array<Vec3, kCells + 1>, kCells + 1> nodes;
  for (int i = 0; i <= kCells; ++i)
    for (int j = 0; j <= kCells; ++j)
      nodes[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)] =
          Vec3(0.08 * i - 0.2, random.between(-0.02, 0.02), 0.08 * j - 0.2);
  for (std::size_t i = 0; i < kCells; ++i) {
    for (std::size_t j = 0; j < kCells; ++j) {
      mesh->addTriangle(bt(nodes[i][j]), bt(nodes[i + 1][j]), bt(nodes[i][j + 1]));
      mesh->addTriangle(bt(nodes[i + 1][j]), bt(nodes[i][j + 1]), bt(nodes[i + 1][j + 1]));
    }
  }
  return mesh;
}

// Tests a box (rounded against a triangle) and a sphere (against which the mesh has no margin) over
// triangles.
void expectTouchesOfMesh(const btConcaveShape& mesh, const RigidMotion& of, unsigned seed) {
  const btBoxShape box(bt(Vec3(0.05, 0.03, 0.04)));
  const btSphereShape sphere(scalar(0.04));
  const Triangles triangles(mesh);
  Random random(seed);
  ShapePair pair;
  Tally boxes, spheres;
  for (int trial = 0; trial < 40; ++trial) {
    RigidMotion motion = tumbling(random, 0.0, 0.0, 40.0);
    motion.centre.position = Vec3{random.between(-0.1, 0.1), 0.11, random.between(-0.1, 0.1)};
    motion.centre.velocity = Vec3(2.0, -random.between(1.0, 7.0), 1.0);
    const double margin =
        static_cast<double>(box.getMargin()) + static_cast<double>(mesh.getMargin());
    const Points core = by_hand::boxCorners(toVec3(box.getHalfExtentsWithoutMargin()), {});
    const auto boxGap = [&](double s) {
      const Points corners = placed(core, motion.poseAt(s));
      double least = kNever;
      for (const Points& triangle : triangles.all) {
        const Points there = placed(triangle, of.poseAt(s));
        const Vec3 centre = motion.centre.positionAt(s);
        if ((centre - by_hand::nearestOnSegment(there[0], there[1], centre)).norm() < 0.25) {
          least = std::min(least, by_hand::hullHull(corners, there));
        }
      }
      return least - margin;
    };
    const auto sphereGap = [&](double s) {
      double least = kNever;
      for (const Points& triangle : triangles.all) {
        const Points there = placed(triangle, of.poseAt(s));
        least = std::min(least, by_hand::pointTriangle(motion.centre.positionAt(s), there[0],
                                                       there[1], there[2]));
      }
      return least - static_cast<double>(sphere.getRadius());
    };
    Times times = timesOf(pair, {&sphere, motion}, {&mesh, of});
    EXPECT_NEAR(pair.proximityAt(0.0).gap, sphereGap(0.0), 1e-15);
    times.expected = searchedTouch(sphereGap, kSubstep, 200, times.found + kGrazing);
    spheres.compare(times);
    if (trial > 10) continue;
    times = timesOf(pair, {&mesh, of}, {&box, motion});
    EXPECT_NEAR(pair.proximityAt(0.0).gap, boxGap(0.0), 1e-15);
    times.expected = searchedTouch(boxGap, kSubstep, 20, times.found + kGrazing);
    boxes.compare(times);
  }
  EXPECT_GT(boxes.touches(), 4);
  EXPECT_GT(spheres.touches(), 10);
}

TEST(ShapePair, MeshesAreTouchedWhereTheirTrianglesAre) {
  const auto data = hills();
  btBvhTriangleMeshShape mesh(data.get(), true);
  mesh.setMargin(scalar(0.002));
  RigidMotion moving;
  moving.centre.velocity = Vec3(0.5, 1.0, -0.5);
  moving.angularVelocity = Vec3(2.0, -3.0, 1.0);
  expectTouchesOfMesh(mesh, {}, 27);
  expectTouchesOfMesh(mesh, moving, 28);
  btScaledBvhTriangleMeshShape scaled(&mesh, bt(Vec3(1.5, 0.5, 0.75)));
  expectTouchesOfMesh(scaled, {}, 29);
}

TEST(ShapePair, TerrainIsTouchedWhereItsTrianglesAre) {
  std::vector<btScalar> heights(49);  // btScalar even for PHY_FLOAT
  Random random(30);
  for (btScalar& height : heights)
    height = scalar(random.between(-0.02, 0.02));
  btHeightfieldTerrainShape terrain(7, 7, heights.data(), scalar(1), scalar(-0.02), scalar(0.02), 1,
                                    PHY_FLOAT, false);
  terrain.setLocalScaling(bt(Vec3(0.06, 1.0, 0.06)));
  terrain.setMargin(scalar(0.001));
  expectTouchesOfMesh(terrain, {}, 31);
}

TEST(ShapePair, AFastBladeTouchesWhatItSweepsOverHowShortEver) {
  const btBoxShape blade(bt(Vec3(0.3, 0.002, 0.004)));
  const btSphereShape bead(scalar(0.004));
  Random random(32);
  ShapePair pair;
  Tally tally;
  for (int trial = 0; trial < 100; ++trial) {
    RigidMotion spinning;
    spinning.angularVelocity = Vec3(0, 0, 150.0);
    spinning.orientation = Quat(Eigen::AngleAxisd(random.between(-kPi, kPi), Vec3::UnitZ()));
    RigidMotion resting;
    resting.centre.position = random.between(0.05, 0.3) * Vec3::UnitX();
    resting.centre.position.z() = random.between(0.0, 0.008);  // at 0.008 the blade just misses
    const Vec3 half = toVec3(blade.getHalfExtentsWithoutMargin());
    const auto gap = [&](double s) {
      const Vec3 local = spinning.poseAt(s).toLocal(resting.centre.position);
      return (local - local.cwiseMax(-half).cwiseMin(half)).norm() -
             static_cast<double>(blade.getMargin()) - static_cast<double>(bead.getRadius());
    };
    if (gap(0.0) <= 0.0) continue;
    Times times = timesOf(pair, {&blade, spinning}, {&bead, resting});
    times.expected = searchedTouch(gap, kSubstep, 20000, times.found + kGrazing);
    tally.compare(times);
  }
  EXPECT_GT(tally.touches(), 20);
}

TEST(ShapePair, CornersThatPassByAMicrometreDoNotTouchAndThoseThatMeetByOneDo) {
  const btBoxShape box(bt(Vec3(0.05, 0.05, 0.05)));
  const double edge = std::sqrt(2.0) * toVec3(box.getHalfExtentsWithMargin()).x();
  ShapePair pair;
  for (const double clearance : {1e-3, 1e-6, 1e-9, -1e-9, -1e-6, -1e-3}) {
    RigidMotion motion, other;  // both on edge, passing under each other
    motion.orientation = other.orientation = Quat(Eigen::AngleAxisd(0.25 * kPi, Vec3::UnitZ()));
    motion.centre.position = Vec3(-0.05, 2.0 * edge + clearance, 0.01);
    motion.centre.velocity = Vec3(10.0, 0.0, 0.0);
    ASSERT_TRUE(pair.set({&box, motion}, {&box, other}, kSubstep, 0.0));
    const double touch = pair.impactTime();
    if (clearance > 0.0) {
      EXPECT_EQ(touch, kNever) << clearance;
    } else {
      EXPECT_NEAR(touch, (0.05 + clearance) / 10.0, 1e-11) << clearance;
    }
  }
}

TEST(ShapePair, AKilometreAwayCostsNoMoreDigitsThanItsPositionsHave) {
  const btBoxShape box(bt(Vec3(0.05, 0.03, 0.08)));
  const btCylinderShape can(bt(Vec3(0.03, 0.06, 0.03)));
  Random random(33);
  ShapePair pair;
  int touches = 0;
  for (int trial = 0; trial < 50; ++trial) {
    RigidMotion motion = tumbling(random, 0.15, 8.0, 20.0);
    RigidMotion other;
    other.orientation = random.orientation();
    const double here = timesOf(pair, {&can, motion}, {&box, other}).found;
    const Vec3 far(1024.0, -512.0, 2048.0);
    motion.centre.position += far;
    other.centre.position += far;
    const double there = timesOf(pair, {&can, motion}, {&box, other}).found;
    EXPECT_NEAR(std::min(there, 1.0), std::min(here, 1.0), 1e-10);
    if (here != kNever) ++touches;
  }
  EXPECT_GT(touches, 20);
}

TEST(ShapePair, WhatIsEmptyFlatOrNotANumberComesToAnEnd) {
  const btBoxShape box(bt(Vec3(0.05, 0.03, 0.08)));
  const btSphereShape grain(scalar(1e-6));
  const btCapsuleShape pill(scalar(0.01), scalar(0));
  const btConvexHullShape nothing;
  const btCompoundShape bag;
  const btEmptyShape none;
  const auto data = hills();
  const btBvhTriangleMeshShape mesh(data.get(), true);
  ShapePair pair;
  MovingShape body{&box, {}};
  body.motion.centre.position = Vec3(0, 0.15, 0);
  body.motion.centre.velocity = Vec3(0, -10, 0);
  EXPECT_FALSE(pair.set(body, {&nothing, {}}, kSubstep, 1.0));
  EXPECT_FALSE(pair.set(body, {&bag, {}}, kSubstep, 1.0));
  EXPECT_FALSE(pair.set(body, {&none, {}}, kSubstep, 1.0));
  EXPECT_EQ(pair.impactTime(), kNever);
  EXPECT_EQ(pair.proximityAt(0.0).gap, kNever);
  EXPECT_FALSE(pair.set({&mesh, {}}, {&mesh, {}}, kSubstep, 1.0));
  EXPECT_NEAR(timesOf(pair, body, {&grain, {}}).found, (0.15 - 0.03 - 1e-6) / 10.0, 1e-9);
  EXPECT_NEAR(timesOf(pair, body, {&pill, {}}).found, (0.15 - 0.03 - 0.01) / 10.0, 1e-9);
  MovingShape turning = body, lost = body, thrown = body;
  turning.motion.angularVelocity = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
  lost.motion.centre.position = turning.motion.angularVelocity;
  thrown.motion.centre.velocity = turning.motion.angularVelocity;
  const btStaticPlaneShape plane(btVector3(0, 1, 0), scalar(0));
  for (const MovingShape& bad : {turning, lost, thrown}) {
    for (const btCollisionShape* shape :
         std::initializer_list<const btCollisionShape*>{&pill, &mesh, &plane, &box}) {
      EXPECT_EQ(timesOf(pair, bad, {shape, {}}).found, kNever);
    }
  }
}

TEST(ShapePair, AllocatesNothingOnceItHasSeenAsMuch) {
  const auto data = hills();
  const btBvhTriangleMeshShape mesh(data.get(), true);
  const btBoxShape box(bt(Vec3(0.05, 0.03, 0.04)));
  Random random(34);
  RigidMotion motion = falling(random, 0.12);
  motion.centre.position.x() = motion.centre.position.z() = 0.0;
  ShapePair pair;
  const auto all = [&] {
    pair.set({&box, motion}, {&mesh, {}}, kSubstep, 0.1);
    pair.impactTime();
    pair.patchAt(0.01, pair.proximityAt(0.01), 0.01);
  };
  all();
  const test::NoAllocScope scope;
  all();
  EXPECT_EQ(scope.allocations(), 0u);
}

TEST(ShapePair, AtATouchOfSharpShapesTheNormalIsThatOfTheFace) {
  const btBoxShape box(bt(Vec3(0.05, 0.05, 0.05)));
  const btBoxShape ground(bt(Vec3(5, 1, 5)));
  Random random(35);
  ShapePair pair;
  for (int trial = 0; trial < 50; ++trial) {
    RigidMotion motion = falling(random, 0.1);
    motion.centre.position.y() += static_cast<double>(scalar(1));
    motion.centre.velocity.y() = -12.0;
    const double touch = timesOf(pair, {&box, motion}, {&ground, {}}).found;
    ASSERT_NE(touch, kNever);
    for (const double s : {touch, touch + 1e-9, touch + 1e-5}) {
      const Proximity there = pair.proximityAt(s);
      EXPECT_NEAR(there.normal.y(), 1.0, 1e-9);
      EXPECT_NEAR(there.otherPoint.y(), 1.0, 1e-7);
      EXPECT_NEAR(there.gap, (there.point - there.otherPoint).dot(there.normal), 1e-9);
    }
  }
}

TEST(ShapePair, APatchHasTheCornersThatLieOnTheOtherShape) {
  const btBoxShape box(bt(Vec3(0.05, 0.03, 0.04)));
  const btBoxShape table(bt(Vec3(0.5, 0.5, 0.5)));
  const btStaticPlaneShape plane(btVector3(0, 1, 0), scalar(0));
  const btCylinderShape can(bt(Vec3(0.03, 0.06, 0.03)));
  ShapePair pair;
  MovingShape body{&box, {}};
  const auto patchOn = [&](const btCollisionShape& shape) {
    pair.set(body, {&shape, {}}, kSubstep, 0.01);
    return pair.patchAt(0.0, pair.proximityAt(0.0), 1e-4);
  };
  body.motion.centre.position.y() = 0.03;
  EXPECT_EQ(patchOn(plane).size(), 4u);  // flat
  body.motion.orientation = Quat(Eigen::AngleAxisd(0.1, Vec3::UnitX()));
  EXPECT_EQ(patchOn(plane).size(), 2u);  // on edge
  body.motion.orientation = Quat(Eigen::AngleAxisd(0.1, Vec3(1, 0, 1).normalized()));
  EXPECT_EQ(patchOn(plane).size(), 1u);
  body.motion.orientation.setIdentity();
  body.motion.centre.position = Vec3(0.5, 0.53, 0.0);  // half over the table's edge
  const auto overEdge = patchOn(table);
  ASSERT_EQ(overEdge.size(), 2u);
  for (const Vec3& corner : overEdge) {
    EXPECT_NEAR(corner.x(), 0.45, 1e-7);
    EXPECT_NEAR(corner.y(), 0.5, 1e-7);
  }
  body.shape = &can;
  body.motion.centre.position = Vec3(0.0, 0.06, 0.0);
  EXPECT_EQ(patchOn(plane).size(), 4u);
  body.motion.centre.position = Vec3(0.0, 0.03, 0.0);
  body.motion.orientation = Quat(Eigen::AngleAxisd(0.5 * kPi, Vec3::UnitX()));
  EXPECT_EQ(patchOn(plane).size(), 2u);
}

TEST(ShapePair, TheLocalShapeIsThatOfTheSideEndOrEdgeThatIsTouched) {
  const btStaticPlaneShape plane(btVector3(0, 1, 0), scalar(0));
  const btBoxShape box(bt(Vec3(0.25, 0.25, 0.25)));
  const btSphereShape sphere(scalar(0.25));
  const btCapsuleShape capsule(scalar(0.25), scalar(1));
  const btCylinderShape cylinder(bt(Vec3(0.25, 0.5, 0.25)));
  ShapePair pair;
  const auto shapeOf = [&](const btCollisionShape& shape, double tilt) {
    MovingShape body{&shape, {}};
    body.motion.centre.position = Vec3(0, 2, 0);
    body.motion.orientation = Quat(Eigen::AngleAxisd(tilt, Vec3::UnitX()));
    pair.set(body, {&plane, {}}, kSubstep, 10.0);
    const Proximity there = pair.proximityAt(0.0);
    const LocalShape flat = pair.localShape(PairSide::other, 0.0, there);
    EXPECT_EQ(flat.radius, kNever);
    EXPECT_EQ(flat.rollingRadius, kNever);
    return pair.localShape(PairSide::body, 0.0, there);
  };
  EXPECT_NEAR(shapeOf(sphere, 0.3).radius, 0.25, 1e-7);
  EXPECT_NEAR(shapeOf(sphere, 0.3).rollingRadius, 0.25, 1e-7);
  EXPECT_NEAR(shapeOf(capsule, 0.3).radius, 0.25, 1e-7);
  EXPECT_NEAR(shapeOf(capsule, 0.5 * kPi).radius, 0.5, 1e-7);
  EXPECT_NEAR(shapeOf(capsule, 0.5 * kPi).rollingRadius, 0.25, 1e-7);
  EXPECT_NEAR(shapeOf(cylinder, 0.5 * kPi).radius, 0.5, 1e-7);
  EXPECT_EQ(shapeOf(cylinder, 0.0).radius, kNever);
  EXPECT_EQ(shapeOf(cylinder, 0.3).radius, 0.0);
  EXPECT_EQ(shapeOf(box, 0.0).radius, kNever);
  EXPECT_EQ(shapeOf(box, 0.3).radius, 0.0);
}

}  // namespace
}  // namespace carom
