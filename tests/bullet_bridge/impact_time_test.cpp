#include "bullet_bridge/geometry/impact_time.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace carom {

using namespace bullet;

namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

// The first time at which `gap` is no longer positive, by brute force.
template <class Gap>
double searched(Gap gap, double horizon) {
  constexpr int kPieces = 20000;
  for (int i = 1; i <= kPieces; ++i) {
    double low = horizon * (i - 1) / kPieces;
    double high = horizon * i / kPieces;
    if (gap(high) > 0.0) continue;
    for (int bit = 0; bit < 100; ++bit) {
      const double middle = 0.5 * (low + high);
      (gap(middle) > 0.0 ? low : high) = middle;
    }
    return high;
  }
  return kNever;
}

TEST(ImpactTime, SpheresInRelativeMotionTouchWhereABruteForceSearchFindsThem) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  int touching = 0;
  for (int trial = 0; trial < 300; ++trial) {
    Motion motion;
    motion.position = 2.0 * Vec3(uniform(random), uniform(random), uniform(random)).normalized();
    motion.velocity =
        -motion.position + 0.8 * Vec3(uniform(random), uniform(random), uniform(random));
    if (trial % 2 == 1) motion.acceleration = 3.0 * Vec3(uniform(random), uniform(random), 0.0);
    const double found = sphereImpactTime(motion, 0.7, 2.0);
    const double expected =
        searched([&](double s) { return motion.positionAt(s).norm() - 0.7; }, 2.0);
    if (expected == kNever) {
      EXPECT_EQ(found, kNever);
    } else {
      ++touching;
      EXPECT_NEAR(found, expected, 1e-10);
    }
  }
  EXPECT_GT(touching, 100);
}

TEST(ImpactTime, APlaneIsTouchedAtTheTextbookTimes) {
  EXPECT_DOUBLE_EQ(planeImpactTime(4.905, 0.0, -9.81, 10.0), 1.0);
  EXPECT_DOUBLE_EQ(planeImpactTime(3.0, -1.5, 0.0, 10.0), 2.0);
  EXPECT_DOUBLE_EQ(planeImpactTime(3.0, 2.0, -2.0, 10.0), 3.0);  // up, and back
  EXPECT_EQ(planeImpactTime(3.0, -1.5, 0.0, 1.9), kNever);       // beyond the horizon
  EXPECT_EQ(planeImpactTime(1.0, -1.0, 0.6, 10.0), kNever);      // it turns around above the plane
  EXPECT_EQ(planeImpactTime(1.0, 0.0, 0.0, 10.0), kNever);
}

TEST(ImpactTime, WhatOverlapsTouchesAtOnceIfItApproachesAndNeverIfNot) {
  const Motion closing{Vec3(0.5, 0, 0), Vec3(-1, 0, 0), Vec3::Zero()};
  const Motion leaving{Vec3(0.5, 0, 0), Vec3(1, 0, 0), Vec3::Zero()};
  EXPECT_EQ(sphereImpactTime(closing, 0.7, 1.0), 0.0);
  EXPECT_EQ(sphereImpactTime(leaving, 0.7, 1.0), kNever);
  EXPECT_EQ(planeImpactTime(-0.1, -1.0, -9.81, 1.0), 0.0);
  EXPECT_EQ(planeImpactTime(-0.1, 1.0, -9.81, 1.0), kNever);
}

TEST(ImpactTime, ADistantAndFastPairLosesNoDigits) {
  // The pair is 1 km apart, closes at 1 km/s and touches after exactly (1000 - 0.01) / 1000 s.
  const Motion motion{Vec3(1000.0, 0, 0), Vec3(-1000.0, 0, 0), Vec3::Zero()};
  EXPECT_NEAR(sphereImpactTime(motion, 0.01, 2.0), 0.99999, 1e-12);
}

}  // namespace
}  // namespace carom
