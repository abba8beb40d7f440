#include "native/math/contact_time.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "tests/native/sphere_worlds.h"

namespace carom {

using namespace native;

namespace {

using test::SplitMix;

/// First time at which `distance` is not above 0, by scanning and bisection, slow and obvious;
/// kNever if there is none before `end`.
template <class Distance>
double firstZero(Distance distance, double end, int scans) {
  for (int scan = 0; scan < scans; ++scan) {
    long double low = static_cast<long double>(end) * scan / scans;
    long double high = static_cast<long double>(end) * (scan + 1) / scans;
    if (distance(high) > 0.0L) continue;
    for (int halving = 0; halving < 80; ++halving) {
      const long double middle = (low + high) / 2.0L;
      (distance(middle) > 0.0L ? low : high) = middle;
    }
    return static_cast<double>(high);
  }
  return kNever;
}

TEST(SphereContactTime, AgreesWithBisectionOfTheDistance) {
  SplitMix random(1);
  int contacts = 0;
  for (int pass = 0; pass < 300; ++pass) {
    const Vec3 d = random.inCube(2.0) + Vec3(3.0, 0.0, 0.0);
    const Vec3 v = random.inCube(1.0) - Vec3(1.0, 0.0, 0.0);
    const auto distance = [&](long double t) {
      long double sum = 0.0L;
      for (int axis = 0; axis < 3; ++axis)
        sum += (d[axis] + t * v[axis]) * (d[axis] + t * v[axis]);
      return std::sqrt(sum) - 0.9L;
    };
    const double expected = firstZero(distance, 20.0, 2000);
    const double found = sphereContactTime(d, v, 0.9);
    if (expected == kNever) {
      // The scan may step over a graze; then the spheres must hardly have touched.
      if (found != kNever) {
        EXPECT_GT(distance(static_cast<long double>(found) + 0.02L), -1e-3L);
      }
      continue;
    }
    ++contacts;
    EXPECT_NEAR(found, expected, 1e-12 * expected);
  }
  EXPECT_GT(contacts, 20);
}

TEST(SphereContactTime, HeadOnIsGapOverSpeedOverTwentyFiveOrdersOfMagnitude) {
  for (const double speed : {1e-9, 1e-3, 1.0, 1e4}) {
    for (const double gap : {1e-6, 1.0, 1e10}) {
      const double time = sphereContactTime({gap + 0.25, 0.0, 0.0}, {-speed, 0.0, 0.0}, 0.25);
      const double exactGap = (gap + 0.25) - 0.25;  // the gap that remains in a double
      EXPECT_NEAR(time * speed / exactGap, 1.0, gap < 1e-3 ? 1e-9 : 1e-14) << speed << ' ' << gap;
    }
  }
}

TEST(SphereContactTime, GrazingWithinOnePartInTenToTheTwelveIsDecidedRightly) {
  const double inside = 1.0 - 1e-12;
  const double outside = 1.0 + 1e-12;
  EXPECT_NEAR(sphereContactTime({1000.0, inside, 0.0}, {-1.0, 0.0, 0.0}, 1.0),
              1000.0 - std::sqrt(2e-12), 1e-8);
  EXPECT_EQ(sphereContactTime({1000.0, outside, 0.0}, {-1.0, 0.0, 0.0}, 1.0), kNever);
  EXPECT_EQ(sphereContactTime({1000.0, 1.0, 0.0}, {-1.0, 0.0, 0.0}, 1.0), 1000.0);
}

TEST(SphereContactTime, SeparatingOrAtRelativeRestIsNever) {
  EXPECT_EQ(sphereContactTime({2.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, 1.0), kNever);
  EXPECT_EQ(sphereContactTime({2.0, 0.0, 0.0}, Vec3::Zero(), 1.0), kNever);
  EXPECT_EQ(sphereContactTime({1.0, 0.0, 0.0}, {1e-9, 0.0, 0.0}, 1.0), kNever);
  EXPECT_EQ(sphereContactTime({1.0, 0.0, 0.0}, {0.0, 3.0, 0.0}, 1.0), kNever);
  EXPECT_EQ(sphereContactTime({0.999, 0.0, 0.0}, {1e-9, 0.0, 0.0}, 1.0), kNever);
}

TEST(SphereContactTime, TouchingAndApproachingIsNow) {
  EXPECT_EQ(sphereContactTime({1.0, 0.0, 0.0}, {-1e-9, 5.0, 0.0}, 1.0), 0.0);
  EXPECT_EQ(sphereContactTime({0.9, 0.0, 0.0}, {-1.0, 0.0, 0.0}, 1.0), 0.0);
}

TEST(SphereContactTime, RadiusRatioOfTenThousandKeepsTheGap) {
  const double sum = 10.0 + 0.001;
  const double time = sphereContactTime({sum + 0.5, 0.0, 0.0}, {-0.25, 0.0, 0.0}, sum);
  EXPECT_NEAR(time, 2.0, 1e-13);
}

TEST(PlaneContactTime, AgreesWithBisectionOfTheHeight) {
  SplitMix random(2);
  for (int fall = 0; fall < 300; ++fall) {
    const double h = random.between(0.01, 3.0);
    const double v = random.between(-4.0, 4.0);
    const double a = random.between(-10.0, 2.0);
    const auto height = [&](long double t) { return h + t * (v + 0.5L * t * a); };
    const double expected = firstZero(height, 100.0, 50000);
    const double found = planeContactTime(h, v, a);
    if (expected == kNever && found != kNever) {
      EXPECT_TRUE(found > 100.0 || height(found + 0.001L) > -1e-4L);
    } else if (expected != kNever) {
      EXPECT_NEAR(found, expected, 1e-12 * std::max(1.0, expected));
    }
  }
}

TEST(PlaneContactTime, ClosedFormsOfFreeFallAndUniformMotion) {
  EXPECT_DOUBLE_EQ(planeContactTime(1.0, 0.0, -9.81), std::sqrt(2.0 / 9.81));
  EXPECT_DOUBLE_EQ(planeContactTime(1.0, -2.0, 0.0), 0.5);
  EXPECT_EQ(planeContactTime(1.0, 2.0, 0.0), kNever);
  EXPECT_EQ(planeContactTime(1.0, 0.0, 0.0), kNever);
  EXPECT_EQ(planeContactTime(1.0, 0.0, 9.81), kNever);
  EXPECT_EQ(planeContactTime(1.0, -1.0, 0.75), kNever);     // turns round above the surface
  EXPECT_DOUBLE_EQ(planeContactTime(1.0, -2.0, 2.0), 1.0);  // grazes the surface
}

TEST(PlaneContactTime, SmallHeightsAndAccelerationsCancelNothing) {
  EXPECT_NEAR(planeContactTime(1e-12, -1.0, -9.81) / 1e-12, 1.0, 1e-11);
  EXPECT_NEAR(planeContactTime(1.0, -1.0, -1e-12), 1.0 - 0.5e-12, 1e-15);
  EXPECT_NEAR(planeContactTime(1e-9, 1e4, -1e-3), 2e7, 1e-7);
}

TEST(PlaneContactTime, TouchingIsDecidedByVelocityThenAcceleration) {
  for (const double height : {0.0, -1e-13}) {
    EXPECT_EQ(planeContactTime(height, -1e-9, 0.0), 0.0);
    EXPECT_EQ(planeContactTime(height, -1e-9, 9.81), 0.0);
    EXPECT_EQ(planeContactTime(height, 0.0, -9.81), 0.0);
    EXPECT_EQ(planeContactTime(height, 0.0, 0.0), kNever);
    EXPECT_EQ(planeContactTime(height, 0.0, 9.81), kNever);
    EXPECT_EQ(planeContactTime(height, 1.0, 0.0), kNever);
    EXPECT_NEAR(planeContactTime(height, 1.0, -9.81), 2.0 / 9.81, 1e-12);
  }
}

TEST(PlaneContactTime, TooSlowToComeOutReturnsToTheSameHeight) {
  EXPECT_DOUBLE_EQ(planeContactTime(-1e-6, 1e-4, -10.0), 2e-5);
}

}  // namespace
}  // namespace carom
