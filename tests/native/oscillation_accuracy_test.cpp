#include <cmath>
#include <optional>

#include <gtest/gtest.h>

#include "native/math/contact_time.h"
#include "native/scheduling/oscillation.h"
#include "tests/native/sphere_worlds.h"

namespace carom {

using namespace native;

namespace {

using test::SplitMix;
using Wide = long double;

const Wide kWidePi = std::acos(Wide(-1.0));

// ---- The oracle: small steps and bisection in long double.

struct OscillatingCase {
  SmoothHeight smooth;
  NormalOscillation oscillation;
};

Wide heightAt(const OscillatingCase& c, Wide t) {
  const Wide angle =
      2.0L * kWidePi * (Wide(c.oscillation.frequency) * t + Wide(c.oscillation.turns));
  return Wide(c.smooth.height) +
         t * (Wide(c.smooth.velocity) + 0.5L * t * Wide(c.smooth.acceleration)) -
         Wide(c.oscillation.amplitude) * std::sin(angle);
}

std::optional<Wide> obviousContact(const OscillatingCase& c, Wide duration, int steps) {
  for (int step = 1; step <= steps; ++step) {
    Wide high = duration * step / steps;
    if (heightAt(c, high) > 0.0L) continue;
    Wide low = duration * (step - 1) / steps;
    for (int halving = 0; halving < 80; ++halving) {
      const Wide middle = 0.5L * (low + high);
      (heightAt(c, middle) <= 0.0L ? high : low) = middle;
    }
    return high;
  }
  return std::nullopt;
}

OscillatingCase randomCase(SplitMix& random) {
  OscillatingCase c;
  c.oscillation = {random.between(-0.02, 0.02), random.between(1.0, 60.0),
                   random.between(0.0, 1.0)};
  c.smooth.velocity = random.between(-2.0, 2.0);
  c.smooth.acceleration = random.between(0.0, 1.0) < 0.2 ? 0.0 : random.between(-12.0, 3.0);
  c.smooth.height = c.oscillation.amplitude * c.oscillation.at({}).sine;
  c.smooth.height +=
      random.between(0.0, 1.0) < 0.5 ? random.between(1e-6, 0.02) : random.between(0.02, 1.0);
  c.smooth.rounding = 1e-15;
  return c;
}

TEST(OscillatingContactTime, OfRandomThrowsIsThatOfSmallStepsAndBisection) {
  constexpr Wide kDuration = 1.5L;
  SplitMix random(3);
  int hits = 0;
  int misses = 0;
  for (int k = 0; k < 2000; ++k) {
    const OscillatingCase c = randomCase(random);
    const double time = oscillatingContactTime(c.smooth, c.oscillation, {}, kNever);
    const auto expected = obviousContact(c, kDuration, 20'000);
    if (!expected) {
      ++misses;
      if (time < 1.5) {
        EXPECT_LT(std::abs(heightAt(c, time)), 1e-14L) << "a graze, at least";
      }
      continue;
    }
    ++hits;
    if (std::abs(Wide(time) - *expected) > 1e-6L) {  // the oracle's steps have missed a graze
      EXPECT_LT(Wide(time), *expected) << k;
      EXPECT_LT(std::abs(heightAt(c, time)), 1e-14L) << k;
      continue;
    }
    const Wide speed =
        std::max((heightAt(c, *expected - 1e-7L) - heightAt(c, *expected)) / 1e-7L, 1e-5L);
    EXPECT_NEAR(time, static_cast<double>(*expected), static_cast<double>(1e-14L / speed)) << k;
  }
  EXPECT_GT(hits, 1000);
  EXPECT_GT(misses, 100);
}

}  // namespace
}  // namespace carom
