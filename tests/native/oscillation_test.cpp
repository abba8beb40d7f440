#include "native/scheduling/oscillation.h"

#include <cmath>

#include <gtest/gtest.h>

#include "native/math/contact_time.h"
#include "tests/native/sphere_worlds.h"

namespace carom {

using namespace native;

namespace {

using test::SplitMix;
using Wide = long double;

const Wide kWidePi = std::acos(Wide(-1.0));

TEST(SineOfTurns, IsWithinTenToTheMinusFifteenOfTheStandardLibrarys) {
  SplitMix random(1);
  for (int k = 0; k < 200'000; ++k) {
    const double turns = random.between(-3.0, 3.0);
    const SineCosine found = sineOfTurns(turns);
    const Wide angle = 2.0L * kWidePi * Wide(turns);
    ASSERT_NEAR(found.sine, static_cast<double>(std::sin(angle)), 1e-15) << turns;
    ASSERT_NEAR(found.cosine, static_cast<double>(std::cos(angle)), 1e-15) << turns;
  }
}

TEST(SineOfTurns, IsExactAtQuarters) {
  for (int quarter = -8; quarter <= 8; ++quarter) {
    const SineCosine found = sineOfTurns(0.25 * quarter);
    constexpr double kSines[] = {0.0, 1.0, 0.0, -1.0};
    EXPECT_EQ(found.sine, kSines[(quarter + 8) % 4]);
    EXPECT_EQ(found.cosine, kSines[(quarter + 9) % 4]);
  }
}

TEST(Oscillation, ItsPhaseIsAsExactAfterADayAsAtTheStart) {
  const NormalOscillation oscillation{1.0, 997.3, 0.2};
  SplitMix random(2);
  for (int k = 0; k < 1000; ++k) {
    const double seconds = random.between(86'000.0, 86'400.0);
    const double rest = random.between(-7e-12, 7e-12);
    const Wide time = Wide(seconds) + Wide(rest);
    Wide turns = Wide(oscillation.frequency) * time;  // long double's 64 bits leave 5e-12 turns
    turns -= std::floor(turns);
    const Wide expected = std::sin(2.0L * kWidePi * (turns + Wide(0.2)));
    EXPECT_NEAR(oscillation.at({seconds, rest}).sine, static_cast<double>(expected), 1e-10);
  }
}

TEST(OscillatingContactTime, WhereTheSurfaceNeverReachesItIsNever) {
  const NormalOscillation oscillation{0.01, 50.0, 0.0};
  const SmoothHeight hovering{0.0101, 0.0, 0.0, 1e-15};
  EXPECT_EQ(oscillatingContactTime(hovering, oscillation, {}, kNever), kNever);
  const SmoothHeight leaving{0.005, 3.5, 0.0, 1e-15};  // faster than the surface, 3.14 m/s
  EXPECT_EQ(oscillatingContactTime(leaving, oscillation, {}, kNever), kNever);
  const SmoothHeight slow{0.005, 1e-9, 0.0, 1e-15};
  EXPECT_LT(oscillatingContactTime(slow, oscillation, {}, kNever), 0.005);
}

TEST(OscillatingContactTime, InTouchItIsNowOrAfterTheReturn) {
  const NormalOscillation oscillation{0.001, 10.0, 0.0};  // starts at 62.8 mm/s
  const double speed = 0.001 * oscillation.angularFrequency();
  EXPECT_EQ(oscillatingContactTime({0.0, 0.0, -9.81, 1e-15}, oscillation, {}, kNever), 0.0);
  EXPECT_EQ(oscillatingContactTime({0.0, speed, -9.81, 1e-15}, oscillation, {}, kNever), 0.0);
  const double back =
      oscillatingContactTime({0.0, speed + 0.001, -9.81, 1e-15}, oscillation, {}, kNever);
  EXPECT_NEAR(back, 2.0 * 0.001 / 9.81, 1e-6) << "a hop";
}

}  // namespace
}  // namespace carom
