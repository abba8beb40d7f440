#include "native/math/polynomial.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "tests/native/sphere_worlds.h"

namespace carom {

using namespace native;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The quartic leading (t - r0) (t - r1) (t - r2) (t - r3).
Quartic withRoots(const std::array<double, 4>& roots, double leading) {
  Quartic product{leading, 0.0, 0.0, 0.0, 0.0};
  for (const double root : roots) {
    for (std::size_t i = product.size() - 1; i > 0; --i)
      product[i] = product[i - 1] - root * product[i];
    product[0] *= -root;
  }
  return product;
}

TEST(FirstFall, IsTheRootWhereTheSignTurnsNegative) {
  const Quartic up = withRoots({-1.0, 0.5, 2.0, 3.0}, 1.0);  // +|-1  -|0.5  +|2  -|3  +
  EXPECT_NEAR(firstFall(up, 0.0), 2.0, 1e-14);
  EXPECT_NEAR(firstFall(up, -5.0), -1.0, 1e-14);
  EXPECT_EQ(firstFall(up, 3.5), kInfinity);
  const Quartic down = withRoots({-1.0, 0.5, 2.0, 3.0}, -1.0);
  EXPECT_NEAR(firstFall(down, 0.0), 0.5, 1e-15);
  EXPECT_NEAR(firstFall(down, 1.0), 3.0, 1e-14);
}

TEST(FirstFall, OfLowerDegreesIsTheTextbooks) {
  EXPECT_EQ(firstFall({6.0, -2.0, 0.0, 0.0, 0.0}, 0.0), 3.0);
  EXPECT_EQ(firstFall({6.0, 2.0, 0.0, 0.0, 0.0}, 0.0), kInfinity);
  EXPECT_EQ(firstFall({1.0, 0.0, 0.0, 0.0, 0.0}, 0.0), kInfinity);
  EXPECT_NEAR(firstFall({5.0, 0.0, -0.5 * 9.81, 0.0, 0.0}, 0.0), std::sqrt(10.0 / 9.81), 1e-15);
  EXPECT_NEAR(firstFall({8.0, 0.0, 0.0, -1.0, 0.0}, 0.0), 2.0, 1e-15);
  EXPECT_NEAR(firstFall({16.0, 0.0, 0.0, 0.0, -1.0}, 0.0), 2.0, 1e-15);
}

TEST(FirstFall, StartsOnTheZeroItself) {
  EXPECT_EQ(firstFall({0.0, -1.0, 0.0, 0.0, 0.0}, 0.0), 0.0);
  EXPECT_EQ(firstFall({0.0, 0.0, -1.0, 0.0, 0.0}, 0.0), 0.0);
  EXPECT_NEAR(firstFall({0.0, 3.0, -1.0, 0.0, 0.0}, 0.0), 3.0, 1e-15);
  // The value begins below zero by rounding and rises: the fall comes later.
  EXPECT_NEAR(firstFall({-1e-17, 3.0, -1.0, 0.0, 0.0}, 0.0), 3.0, 1e-14);
}

TEST(FirstFall, ADoubleRootIsTouchedAndNotPassed) {
  EXPECT_EQ(firstFall(withRoots({1.0, 1.0, 3.0, 3.0}, 1.0), 0.0), kInfinity);
  // If the quartic is lower by one part in 1e12, both roots are passed.
  Quartic lower = withRoots({1.0, 1.0, 3.0, 3.0}, 1.0);
  lower[0] -= 1e-12;
  EXPECT_NEAR(firstFall(lower, 0.0), 1.0 - 0.5e-6, 1e-8);
}

// The oracle evaluates every polynomial on a fine grid in long double: no fall of the sign may be
// missed.
TEST(FirstFall, OfRandomPolynomialsIsTheFirstOnAFineGrid) {
  test::SplitMix random(11);
  for (int trial = 0; trial < 2000; ++trial) {
    Quartic polynomial{};
    for (double& coefficient : polynomial)
      coefficient = random.between(-1.0, 1.0);
    const double found = firstFall(polynomial, 0.0);
    const auto at = [&](long double t) {
      long double sum = 0.0L;
      for (std::size_t i = polynomial.size(); i-- > 0;)
        sum = sum * t + static_cast<long double>(polynomial[i]);
      return sum;
    };
    constexpr double kStep = 1e-3;
    double first = kInfinity;
    for (double t = 0.0; t < 20.0 && first == kInfinity; t += kStep) {
      if (at(t) >= 0.0L && at(t + kStep) < 0.0L) first = t;
    }
    if (first == kInfinity) {
      EXPECT_GT(found, 20.0 - kStep) << trial;
    } else {
      EXPECT_GE(found, first) << trial;
      EXPECT_LE(found, first + kStep) << trial;
      EXPECT_LE(std::abs(static_cast<double>(at(found))), 1e-14 * (1.0 + std::pow(found, 4.0)));
    }
  }
}

TEST(FirstFall, HoldsForCoefficientsOfVeryDifferentSize) {
  // A tiny leading coefficient from rounding must not hide the root of the quadratic.
  EXPECT_NEAR(firstFall({1.0, 0.0, -1.0, 0.0, 1e-30}, 0.0), 1.0, 1e-15);
  EXPECT_NEAR(firstFall({1e-20, -1e-10, 0.0, 1e-40, -1e-60}, 0.0), 1e-10, 1e-24);
  EXPECT_NEAR(firstFall({1e20, 0.0, -1.0, 0.0, 0.0}, 0.0), 1e10, 1e-5);
}

}  // namespace
}  // namespace carom
