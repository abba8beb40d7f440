#include "native/scheduling/box_contact.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <gtest/gtest.h>

#include "tests/native/sphere_worlds.h"

namespace carom {

using namespace native;

namespace {

using test::SplitMix;
using Wide = long double;

// ---- The oracle: small steps and bisection, on the distance to the nearest point of the box.

Wide coordinateAt(const BoxPath& path, Eigen::Index axis, Wide t) {
  return Wide(path.position[axis]) +
         t * (Wide(path.velocity[axis]) + Wide(0.5) * t * Wide(path.acceleration[axis]));
}

Wide distanceAt(const Vec3& halfExtents, const BoxPath& path, Wide t) {
  Wide sum = 0.0L;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Wide at = coordinateAt(path, axis, t);
    const Wide half = halfExtents[axis];
    const Wide nearest = std::clamp(at, -half, half);
    sum += (at - nearest) * (at - nearest);
  }
  return std::sqrt(sum);
}

constexpr int kSteps = 4000;
constexpr double kRounding = 1e-15;  ///< relative to the ways that are added up

/// First fall below the distance `radius` after the path has been farther away, if a step shows it.
std::optional<Wide> obviousContact(const Vec3& halfExtents, const BoxPath& path, double radius,
                                   Wide duration) {
  bool apart = false;
  for (int step = 0; step <= kSteps; ++step) {
    const Wide t = duration * step / kSteps;
    const bool touching = distanceAt(halfExtents, path, t) <= radius;
    if (touching && apart) {
      Wide low = duration * (step - 1) / kSteps;
      Wide high = t;
      for (int halving = 0; halving < 80; ++halving) {
        const Wide middle = 0.5L * (low + high);
        (distanceAt(halfExtents, path, middle) <= radius ? high : low) = middle;
      }
      return high;
    }
    apart = apart || !touching;
  }
  return std::nullopt;
}

/// Least distance from the box around `time`; between two steps the path may dip into contact
/// unseen.
Wide nearestBetween(const Vec3& halfExtents, const BoxPath& path, Wide time, Wide duration) {
  Wide nearest = distanceAt(halfExtents, path, time);
  for (int k = -50; k <= 50; ++k) {
    const Wide t = time + duration / kSteps * k / 50.0L;
    nearest = std::min(nearest, distanceAt(halfExtents, path, std::max(t, 0.0L)));
  }
  return nearest;
}

struct Thrown {
  Vec3 halfExtents;
  BoxPath path;
  double radius = 0.0;
};

/// A throw from outside at the neighbourhood of a random point of the box.
Thrown randomThrow(SplitMix& random, int flatAxes) {
  Thrown thrown;
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    thrown.halfExtents[axis] = axis < flatAxes ? 0.0 : random.between(0.1, 1.0);
  thrown.radius = random.between(0.02, 0.6);
  Vec3 target;
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    target[axis] = random.between(-1.4, 1.4) * (thrown.halfExtents[axis] + 0.7 * thrown.radius);
  thrown.path.velocity = random.inCube(3.0);
  thrown.path.acceleration = random.between(0.0, 1.0) < 0.3 ? Vec3::Zero() : random.inCube(10.0);
  const double time = random.between(0.3, 0.9);
  thrown.path.position =
      target - time * thrown.path.velocity - 0.5 * time * time * thrown.path.acceleration;
  return thrown;
}

struct Tally {
  int faces = 0;
  int edges = 0;
  int corners = 0;
  int misses = 0;
};

void count(BoxFeature feature, Tally& tally) {
  if (feature == BoxFeature::face) ++tally.faces;
  if (feature == BoxFeature::edge) ++tally.edges;
  if (feature == BoxFeature::corner) ++tally.corners;
}

void compareWithOracle(const Thrown& thrown, Tally& tally) {
  constexpr Wide kDuration = 2.0L;
  const auto& [halfExtents, path, radius] = thrown;
  const double time = boxContactTime(halfExtents, path, radius);
  const std::optional<Wide> expected = obviousContact(halfExtents, path, radius, kDuration);
  if (time <= static_cast<double>(kDuration)) {
    const double way = path.position.norm() + time * path.velocity.norm() +
                       0.5 * time * time * path.acceleration.norm();
    const double rounding = kRounding * (1.0 + way);
    const Vec3 at = path.position + time * (path.velocity + 0.5 * time * path.acceleration);
    count(nearestOf(halfExtents, at).feature, tally);
    ASSERT_NEAR(static_cast<double>(distanceAt(halfExtents, path, time)), radius, 2.0 * rounding);
    if (expected && std::abs(*expected - Wide(time)) < 1e-6L) {
      // A slow approach spreads the rounding of the distance over more time.
      const Wide before = distanceAt(halfExtents, path, Wide(time) - 1e-7L);
      const Wide speed = std::max((before - Wide(radius)) / 1e-7L, 1e-4L);
      ASSERT_NEAR(time, static_cast<double>(*expected),
                  2.0 * rounding / static_cast<double>(speed));
    } else {  // the oracle's steps have missed a graze
      ASSERT_TRUE(!expected || *expected > Wide(time));
      ASSERT_LE(nearestBetween(halfExtents, path, time, kDuration), Wide(radius) * (1.0L + 1e-13L));
    }
  } else {
    ++tally.misses;
    ASSERT_FALSE(expected) << static_cast<double>(*expected);
  }
}

class BoxContactTime : public ::testing::TestWithParam<int> {};

TEST_P(BoxContactTime, OfRandomThrowsIsThatOfSmallStepsAndBisection) {
  SplitMix random(static_cast<std::uint64_t>(77 + GetParam()));
  Tally tally;
  for (int k = 0; k < 2500; ++k) {
    Thrown thrown = randomThrow(random, GetParam());
    if (nearestOf(thrown.halfExtents, thrown.path.position).distance <= thrown.radius) continue;
    ASSERT_NO_FATAL_FAILURE(compareWithOracle(thrown, tally)) << k;
  }
  const int flat = GetParam();
  EXPECT_GT(tally.misses, 100);
  EXPECT_TRUE(flat < 2 ? tally.faces > 100 : tally.faces == 0) << tally.faces;
  EXPECT_TRUE(flat < 3 ? tally.edges > 100 : tally.edges == 0) << tally.edges;
  EXPECT_GT(tally.corners, 30);
}

INSTANTIATE_TEST_SUITE_P(BoxRectangleNeedleAndPoint, BoxContactTime, ::testing::Range(0, 4));

// ---- Closed forms

const Vec3 kHalf{1.0, 0.5, 0.25};

TEST(BoxContact, AGrazeOfFaceEdgeOrCornerHitsOrMissesWithinOnePartInTenToTheTwelve) {
  for (const double inside : {1e-12, -1e-12}) {
    const double radius = 0.3;
    const double reach = radius * (1.0 - inside);
    const double s = std::sqrt(0.5);
    const double c = std::sqrt(1.0 / 3.0);
    // Edge and corner are passed in a straight line at the distance `reach`, the face by a throw.
    const BoxPath edge{{-3.0, 0.5 + s * reach, 0.25 + s * reach}, {1.0, 0.0, 0.0}, Vec3::Zero()};
    const Vec3 diagonal(s, -s, 0.0);
    const BoxPath corner{Vec3(1.0, 0.5, 0.25) + reach * Vec3(c, c, c) - 2.0 * diagonal, diagonal,
                         Vec3::Zero()};
    const BoxPath face{{-0.5, 0.5 + reach + 0.5, 0.0}, {0.5, -1.0, 0.0}, {0.0, 1.0, 0.0}};
    for (const BoxPath& path : {edge, corner, face})
      EXPECT_EQ(boxContactTime(kHalf, path, radius) < kNever, inside > 0.0);
  }
}

TEST(BoxContact, OverTheMiddleOfAFaceTheFallIsThatOntoAPlane) {
  const BoxPath path{{0.2, 0.5 + 0.3 + 1.0, 0.1}, {0.1, 0.0, 0.0}, {0.0, -9.81, 0.0}};
  EXPECT_NEAR(boxContactTime(kHalf, path, 0.3), std::sqrt(2.0 / 9.81), 1e-15);
}

TEST(BoxContact, AThrowOverTheBoxLandsOnTheFarSideOfARectangle) {
  // A rectangle is solid on both faces, and the ball may come from below.
  const Vec3 sheet(0.5, 0.0, 0.5);
  const BoxPath under{{0.0, -0.4, 0.0}, {0.0, 2.0, 0.0}, Vec3::Zero()};
  EXPECT_NEAR(boxContactTime(sheet, under, 0.1), 0.15, 1e-16);
  EXPECT_EQ(nearestOf(sheet, {0.1, -0.1, 0.0}).face, 3U);
  EXPECT_EQ(nearestOf(sheet, {0.1, -0.1, 0.0}).normal, -Vec3::UnitY());
  EXPECT_EQ(nearestOf(sheet, {0.6, 0.0, 0.0}).feature, BoxFeature::edge);
}

TEST(BoxContact, InTouchAtTheStartItIsNowOrAfterTheReturn) {
  const double radius = 0.25;
  const Vec3 on(0.2, 0.5 + radius, 0.1);
  const Vec3 down(0.0, -10.0, 0.0);
  EXPECT_EQ(boxContactTime(kHalf, {on, -Vec3::UnitY(), Vec3::Zero()}, radius), 0.0);
  EXPECT_EQ(boxContactTime(kHalf, {on, Vec3::Zero(), down}, radius), 0.0);
  EXPECT_EQ(boxContactTime(kHalf, {on, Vec3::Zero(), Vec3::Zero()}, radius), kNever);
  EXPECT_EQ(boxContactTime(kHalf, {on, Vec3::UnitY(), Vec3::Zero()}, radius), kNever);
  EXPECT_NEAR(boxContactTime(kHalf, {on, Vec3::UnitY(), down}, radius), 0.2, 1e-15);
  for (const double error : {-1e-10, -1e-16, 0.0, 1e-16}) {  // on an edge, with rounding
    const double s = std::sqrt(0.5);
    const Vec3 over = Vec3(1.0, 0.5, 0.1) + (radius + error) * Vec3(s, s, 0.0);
    const Vec3 out(s, s, 0.0);
    EXPECT_EQ(boxContactTime(kHalf, {over, out, Vec3::Zero()}, radius), kNever) << error;
    EXPECT_NEAR(boxContactTime(kHalf, {over, out, -10.0 * out}, radius), 0.2, 1e-9) << error;
    EXPECT_LE(boxContactTime(kHalf, {over, -out, Vec3::Zero()}, radius), 1e-15) << error;
  }
}

TEST(BoxContact, AHorizonChangesNoBitOfWhatIsBeforeIt) {
  SplitMix random(5);
  for (int k = 0; k < 500; ++k) {
    const Thrown thrown = randomThrow(random, 0);
    const double time = boxContactTime(thrown.halfExtents, thrown.path, thrown.radius);
    for (const double more : {1.0, 1.5, 100.0}) {
      EXPECT_EQ(boxContactTime(thrown.halfExtents, thrown.path, thrown.radius, more * time), time);
    }
  }
}

TEST(BoxContact, AFaceIsLeftWhereItsBorderIs) {
  const BoxPath path{{0.9, 0.8, 0.0}, {0.5, 0.0, -1.0}, Vec3::Zero()};
  EXPECT_NEAR(faceExitTime(kHalf, path, 2), 0.2, 1e-16) << "by x, before z at 0.25";
  const BoxPath back{{0.9, 0.8, 0.0}, {-0.5, 0.0, 0.0}, {1.0, 0.0, 0.0}};
  EXPECT_NEAR(faceExitTime(kHalf, back, 2), 0.5 + std::sqrt(0.45), 1e-15);
  const BoxPath out{{1.0, 0.8, 0.0}, {0.5, 0.0, 0.0}, Vec3::Zero()};
  EXPECT_EQ(faceExitTime(kHalf, out, 2), 0.0);
  const BoxPath still{{1.0, 0.8, 0.0}, Vec3::Zero(), Vec3::Zero()};
  EXPECT_EQ(faceExitTime(kHalf, still, 2), kNever);
}

TEST(BoxContact, AxesAreThoseOfTheQuaternionsMatrix) {
  SplitMix random(8);
  for (int k = 0; k < 100; ++k) {
    Quat orientation{random.between(-1.0, 1.0), random.between(-1.0, 1.0),
                     random.between(-1.0, 1.0), random.between(-1.0, 1.0)};
    orientation.normalize();
    const auto axes = columnsOf(orientation);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const Vec3 rotated = orientation * Vec3::Unit(axis);
      EXPECT_LT((axes[static_cast<std::size_t>(axis)] - rotated).norm(), 1e-15);
    }
  }
}

}  // namespace
}  // namespace carom
