#include "bullet_bridge/shapes/gjk.h"

#include <cmath>
#include <limits>
#include <memory>

#include <gtest/gtest.h>

#include "bullet_bridge/bodies/body_tracker.h"
#include "tests/bullet_bridge/nearest_by_hand.h"
#include "tests/bullet_bridge/random_motion.h"
#include "tests/bullet_bridge/vectors.h"

namespace carom {

using namespace bullet;

namespace {

using by_hand::Points;
using by_hand::RoundSet;

Vec3 rounded(const Vec3& v) {  // rounds to the numbers that Bullet stores
  return {static_cast<double>(static_cast<btScalar>(v.x())),
          static_cast<double>(static_cast<btScalar>(v.y())),
          static_cast<double>(static_cast<btScalar>(v.z()))};
}

Pose randomPose(Random& random, double distance) {
  const Vec3 position = distance * random.direction();
  return {position, random.orientation().toRotationMatrix()};
}

Points placed(Points points, const Pose& pose) {
  for (Vec3& point : points)
    point = pose.toWorld(point);
  return points;
}

CoreDistance distanceOf(const ConvexPiece& one, const Pose& pose, const ConvexPiece& two,
                        const Pose& otherPose) {
  return coreDistance({&one, pose.rotation, pose.position},
                      {&two, otherPose.rotation, otherPose.position}, Vec3::UnitX());
}

void expectConsistent(const CoreDistance& found, double size) {
  EXPECT_NEAR(found.normal.norm(), 1.0, 1e-12);
  const Vec3 apart = found.point - found.otherPoint;
  EXPECT_NEAR((apart - found.distance * found.normal).norm(), 0.0, 1e-13 * size);
  EXPECT_LT(found.iterations, 80);
}

TEST(Gjk, HullsAreAsFarApartAsTheirNearestCornersEdgesAndFaces) {
  Random random(11);
  int apart = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const double size = std::pow(10.0, random.between(-3.0, 1.0));  // the other size is 1
    Points corners, otherCorners;
    btConvexHullShape hull, other;
    for (int i = 0; i < 8; ++i) {
      corners.push_back(rounded((size * random.inCube())));
      otherCorners.push_back(rounded((1.0 * random.inCube())));
      hull.addPoint(bt(corners.back()));
      other.addPoint(bt(otherCorners.back()));
    }
    const Pose pose = randomPose(random, 1.2 * (1.0 + size));
    const Pose otherPose = randomPose(random, 0.1);
    const double expected =
        by_hand::hullHullOrOverlap(placed(corners, pose), placed(otherCorners, otherPose));
    const CoreDistance found =
        distanceOf(*ConvexPiece::from(hull), pose, *ConvexPiece::from(other), otherPose);
    if (expected <= 0.0) {
      EXPECT_EQ(found.distance, 0.0);
      continue;
    }
    ++apart;
    EXPECT_NEAR(found.distance, expected, 2e-14 * (1.0 + size)) << "size " << size;
    expectConsistent(found, 1.0 + size);
  }
  EXPECT_GT(apart, 150);
}

// A pose that hardly differs from the last, one anywhere else and one in which the cores overlap
// take turns: what was nearest before is of use, of none, or around the origin.
TEST(Gjk, ASearchThatBeginsWhereAnotherEndedFindsTheSameDistance) {
  Random random(29);
  int apart = 0;
  for (int trial = 0; trial < 40; ++trial) {
    Points corners, otherCorners;
    btConvexHullShape hull;
    btBoxShape box(btVector3(btScalar(0.5), btScalar(0.25), btScalar(0.125)));
    box.setMargin(btScalar(0));
    for (int i = 0; i < 8; ++i) {
      corners.push_back(rounded(random.inCube()));
      hull.addPoint(bt(corners.back()));
      otherCorners.emplace_back((i & 1) != 0 ? 0.5 : -0.5, (i & 2) != 0 ? 0.25 : -0.25,
                                (i & 4) != 0 ? 0.125 : -0.125);
    }
    const ConvexPiece piece = *ConvexPiece::from(hull);
    const ConvexPiece other = *ConvexPiece::from(box);
    Pose pose = randomPose(random, 2.0);
    NearestCorners kept;
    for (int step = 0; step < 12; ++step) {
      if (step % 4 == 3) pose = randomPose(random, random.between(0.1, 3.0));
      pose.position += 1e-3 * random.direction();
      const double expected = by_hand::hullHullOrOverlap(placed(corners, pose), otherCorners);
      const PlacedPiece first{&piece, pose.rotation, pose.position};
      const PlacedPiece second{&other, Eigen::Matrix3d::Identity(), Vec3::Zero()};
      const CoreDistance found =
          coreDistance(first, second, DistanceSearch{.guess = Vec3::UnitX(), .corners = &kept});
      const CoreDistance enough =
          coreDistance(first, second, DistanceSearch{.guess = Vec3::UnitX(), .farthest = 0.5});
      EXPECT_EQ(enough.distance > 0.5, expected > 0.5);
      EXPECT_NEAR(found.distance, std::max(expected, 0.0), 4e-14);
      if (expected <= 0.0) continue;
      ++apart;
      expectConsistent(found, 2.0);
    }
  }
  EXPECT_GT(apart, 200);
}

struct Round {
  RoundSet set;
  std::unique_ptr<btConvexShape> shape;
};

double radiusOf(const btConvexShape& shape) {
  if (shape.getShapeType() == CONE_SHAPE_PROXYTYPE) {
    return static_cast<double>(static_cast<const btConeShape&>(shape).getRadius());
  }
  return static_cast<double>(static_cast<const btCylinderShape&>(shape).getRadius());
}

// A shape without margin, so that the set is its core, with the sizes that Bullet made of the given
// ones.
Round randomRound(Random& random, int kind) {
  Round round;
  const auto r = static_cast<btScalar>(random.between(0.02, 0.5));
  const auto h = static_cast<btScalar>(random.between(0.02, 0.5));
  if (kind == 0) {
    round.set.kind = RoundSet::Kind::segment;
    round.shape = std::make_unique<btCapsuleShape>(r, btScalar(2) * h);
  } else if (kind == 1) {
    round.set.kind = RoundSet::Kind::box;
    round.shape = std::make_unique<btBoxShape>(btVector3(r, h, r));
  } else if (kind == 2) {
    round.set.kind = RoundSet::Kind::cylinder;
    round.shape = std::make_unique<btCylinderShape>(btVector3(r, h, r));
  } else {
    round.set.kind = RoundSet::Kind::cone;
    round.shape = std::make_unique<btConeShape>(r, btScalar(2) * h);
  }
  round.shape->setMargin(btScalar(0));
  const btVector3 top =
      round.shape->localGetSupportingVertexWithoutMargin(btVector3(1, btScalar(0.001), 1));
  round.set.half = toVec3(top);
  round.set.radius = std::hypot(round.set.half.x(), round.set.half.z());
  round.set.halfHeight = std::abs(round.set.half.y());
  if (kind == 2 || kind == 3) round.set.radius = radiusOf(*round.shape);
  return round;
}

TEST(Gjk, RoundCoresAreAsFarApartAsAlternatingProjectionsFind) {
  Random random(12);
  int compared = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const Round one = randomRound(random, trial % 4);
    const Round two = randomRound(random, trial / 4 % 4);
    const Pose pose = randomPose(random, 1.0);
    const Pose otherPose = randomPose(random, 0.1);
    Vec3 start = pose.position;
    const double expected = by_hand::roundRound(one.set, pose, two.set, otherPose, start);
    if (expected < 0.02) continue;  // the projections are slow there, or the sets overlap
    ++compared;
    const CoreDistance found =
        distanceOf(*ConvexPiece::from(*one.shape), pose, *ConvexPiece::from(*two.shape), otherPose);
    EXPECT_NEAR(found.distance, expected, 5e-12) << trial % 4 << " " << trial / 4 % 4;
    expectConsistent(found, 1.0);
  }
  EXPECT_GT(compared, 250);
}

TEST(Gjk, ParallelFacesEdgesAndCopiesOfAShapeHaveTheirTextbookDistance) {
  const btBoxShape box(btVector3(1, 2, 3));
  const ConvexPiece piece = ConvexPiece::from(box)->withSharpEdges();
  Pose here, there;
  for (const double distance : {1e-9, 1e-3, 1.0, 1e3}) {
    here.position = Vec3(2.0 + distance, 0.3, -0.7);  // face on face
    const double exact = here.position.x() - 2.0;
    EXPECT_NEAR(distanceOf(piece, here, piece, there).distance, exact, 1e-14 * (1.0 + distance));
    here.position = Vec3(2.0 + distance, 4.0 + distance, 0.2);  // edge along edge
    EXPECT_NEAR(distanceOf(piece, here, piece, there).distance,
                std::hypot(here.position.x() - 2.0, here.position.y() - 4.0),
                1e-14 * (1.0 + distance));
  }
  const btCapsuleShape rod(btScalar(0.5), btScalar(2));
  const ConvexPiece segment = *ConvexPiece::from(rod);
  here.position = Vec3(3.0, 0.25, 4.0);
  EXPECT_NEAR(distanceOf(segment, here, segment, there).distance, 5.0, 1e-14);
  here.position = Vec3(0.0, 7.0, 0.0);  // end to end
  EXPECT_NEAR(distanceOf(segment, here, segment, there).distance, 5.0, 1e-14);
  EXPECT_EQ(distanceOf(piece, there, piece, there).distance, 0.0);
  EXPECT_EQ(distanceOf(segment, there, segment, there).distance, 0.0);
}

TEST(Gjk, TrianglesWithoutAreaAreTheSegmentOrPointThatTheyAre) {
  const Vec3 tip(1, 0, 0);
  const ConvexPiece needle = ConvexPiece::from({Vec3(-1, 0, 0), tip, Vec3(0.5, 0, 0)}, 0.0);
  const ConvexPiece dot = ConvexPiece::from({tip, tip, tip}, 0.0);
  const ConvexPiece face = ConvexPiece::from({Vec3(-5, 0, -5), Vec3(5, 0, -5), Vec3(0, 0, 9)}, 0.0);
  const Pose still;
  const Pose lifted{Vec3(0.1, 2.0, 0.1), Eigen::Matrix3d::Identity()};
  EXPECT_NEAR(distanceOf(needle, lifted, face, still).distance, 2.0, 1e-14);
  EXPECT_NEAR(distanceOf(dot, lifted, face, still).distance, 2.0, 1e-14);
  EXPECT_NEAR(distanceOf(needle, lifted, dot, still).distance, std::hypot(2.0, 0.1), 1e-14);
  EXPECT_NEAR(distanceOf(face, lifted, face, still).distance, 2.0, 1e-14);
}

TEST(Gjk, AMillimetreIsFoundAsExactlyBesideTenMetresAsAlone) {
  const btBoxShape ground(btVector3(10, 10, 10));
  const btBoxShape grain(btVector3(btScalar(0.0005), btScalar(0.0005), btScalar(0.0005)));
  const ConvexPiece large = ConvexPiece::from(ground)->withSharpEdges();
  const ConvexPiece small = ConvexPiece::from(grain)->withSharpEdges();
  Random random(13);
  for (int trial = 0; trial < 300; ++trial) {
    Pose pose{Vec3{random.between(-9, 9), 10.0 + random.between(1e-3, 2e-3), random.between(-9, 9)},
              random.orientation().toRotationMatrix()};

    const Vec3 half = small.support(Vec3::Ones());
    const double lowest = pose.position.y() - pose.rotation.row(1).cwiseAbs().dot(half) -
                          large.support(Vec3::Ones()).y();
    EXPECT_NEAR(distanceOf(small, pose, large, {}).distance, lowest, 1e-14);
  }
}

TEST(Gjk, WhatIsNotANumberComesToAnEnd) {
  const btBoxShape box(btVector3(1, 1, 1));
  const ConvexPiece piece = *ConvexPiece::from(box);
  const Pose nowhere{Vec3::Constant(std::numeric_limits<double>::quiet_NaN()),
                     Eigen::Matrix3d::Identity()};
  EXPECT_LT(distanceOf(piece, nowhere, piece, {}).iterations, 101);
}

}  // namespace
}  // namespace carom
