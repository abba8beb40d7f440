#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/bar_strike.h"

namespace carom::test {
namespace {

constexpr double kLevelBar = 0.5;  // dB
constexpr double kEndLoss = 0.22;  // Blevins 1979, table 14-2: see tests/bench/modal_levels.cpp

double decibels(double ratio) {
  return 20.0 * std::log10(ratio);
}

// Levels from the mesh to pascals are compared with closed forms of the shapes, of the contact and
// of the air around a slender bar: 8 mm thick, 300 mm long, hit near its end.
TEST(ModalLevels, RingAndClickOfASteelBarAreThoseOfTheirClosedForms) {
  const FreeBar bar{.material = *findMaterial("carbon_steel")};
  BallStrike ball{.ball = bar.material, .speed = 1.0};
  ball.ballRadius = 0.004;
  const StruckBar struck = struckBar(
      bar, ball, 0.147, {.degreesOfFreedom = 5000, .modes = 4, .sides = 12, .slices = 26});
  const Vec3 listener(std::numbers::sqrt2 / 2.0, std::numbers::sqrt2 / 2.0, 0.0);
  const std::vector<Partial> partials = partialsOf(struck, ringOf(struck, listener, 9600));
  ASSERT_EQ(partials.size(), 2u);
  for (const int number : {1, 2}) {
    const Partial expected = partialOf(struck, BendingMode(bar, number), listener, kEndLoss);
    const Partial& ours = partials[static_cast<std::size_t>(number - 1)];
    EXPECT_NEAR(ours.frequency, expected.frequency, 0.01 * expected.frequency);
    EXPECT_NEAR(decibels(ours.amplitude / expected.amplitude), 0.0, kLevelBar) << number;
  }
  const Vec3 across(0.0, 1.0, 0.0);
  const std::vector<double> click = clickOf(struck, across, 960);
  for (const double low : {250.0, 500.0}) {
    EXPECT_NEAR(decibels(std::sqrt(bandEnergy(click, low, 2.0 * low) /
                                   bandEnergy(struck, across, kEndLoss, low, 2.0 * low))),
                0.0, kLevelBar)
        << low;
  }
}

// A thin bar has the roots of the free Euler-Bernoulli beam, 4.7300 and 7.8532 (Blevins 1979, table
// 8-1). Its shapes are orthonormal in mass, without momentum.
TEST(ModalLevels, TheBarItselfIsAThinFreeBeam) {
  const FreeBar bar{.material = *findMaterial("carbon_steel"), .length = 0.3, .radius = 0.0003};
  const double unit = 0.5 * bar.radius / (bar.length * bar.length) *
                      std::sqrt(bar.material.youngsModulus / bar.material.density);
  const BendingMode first(bar, 1);
  const BendingMode third(bar, 3);
  EXPECT_NEAR(first.omega(), 4.7300 * 4.7300 * unit, 1e-4 * first.omega());
  EXPECT_NEAR(BendingMode(bar, 2).omega(), 7.8532 * 7.8532 * unit, 1e-4 * first.omega() * 3.0);
  double momentum = 0.0;
  double square = 0.0;
  double product = 0.0;
  for (int slice = 0; slice < 1000; ++slice) {
    const double x = bar.length * ((slice + 0.5) / 1000.0 - 0.5);
    momentum += first.deflection(x) / 1000.0;
    square += first.deflection(x) * first.deflection(x) / 1000.0;
    product += first.deflection(x) * third.deflection(x) / 1000.0;
  }
  EXPECT_NEAR(bar.mass() * square, 1.0, 1e-4);
  EXPECT_NEAR(bar.mass() * product, 0.0, 1e-4);
  EXPECT_NEAR(momentum * std::sqrt(bar.mass()), 0.0, 1e-4);
}

}  // namespace
}  // namespace carom::test
