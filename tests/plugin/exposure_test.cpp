#include "plugin/realtime/exposure.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

namespace carom::plugin {
namespace {

constexpr double kRate = 48000.0;
constexpr std::size_t kSecond = 48000;

/// Pressures and the samples that become of them.
class Exposed {
 public:
  Exposure exposure{kRate};

  /// Applies the exposure in blocks of that length.
  std::vector<float> apply(std::vector<float> pressure, std::size_t block = 100) {
    for (std::size_t first = 0; first < pressure.size(); first += block) {
      float* const channel = pressure.data() + first;
      const std::size_t frames = std::min(block, pressure.size() - first);
      exposure.apply(std::span(&channel, 1), frames, position_);
      position_ += static_cast<std::int64_t>(frames);
    }
    return pressure;
  }

 private:
  std::int64_t position_ = 0;
};

std::vector<float> clickAt(std::size_t place, float pressure, std::size_t length = kSecond) {
  std::vector<float> samples(length, 0.0F);
  samples[place] = pressure;
  return samples;
}

double decibels(double ratio) {
  return 20.0 * std::log10(ratio);
}

TEST(Exposure, BringsAnAnnouncedFirstBlowToItsTargetWhateverItsPressure) {
  for (const float pressure : {0.5F, 3.0F, 5000.0F}) {
    Exposed exposed;
    exposed.exposure.expect(20000, static_cast<double>(pressure));
    const std::vector<float> samples = exposed.apply(clickAt(20000, pressure));
    EXPECT_NEAR(decibels(static_cast<double>(samples[20000]) / Exposure::kTarget), 0.0, 1.0)
        << pressure;
  }
}

// A landing that is far away has been announced before a blow nearby, and comes after it.
TEST(Exposure, AFarSoundDoesNotHoldUpANearOne) {
  Exposed exposed;
  exposed.exposure.expect(40000, 1.0);
  exposed.exposure.expect(20000, 50.0);
  const std::vector<float> samples = exposed.apply(clickAt(20000, 50.0F));
  EXPECT_NEAR(decibels(static_cast<double>(samples[20000]) / Exposure::kTarget), 0.0, 1.0);
}

TEST(Exposure, KeepsWhatIsHardlyAudibleQuiet) {
  Exposed exposed;
  exposed.exposure.expect(20000, 1e-4);
  const std::vector<float> samples = exposed.apply(clickAt(20000, 1e-4F));
  EXPECT_NEAR(samples[20000], 1e-4 / Exposure::kLeastFullScale, 1e-4);
}

TEST(Exposure, IsBelowItsTargetWhereTheFirstSoundIsQuieterThanPredicted) {
  Exposed exposed;
  exposed.exposure.predict(10.0);
  const std::vector<float> samples = exposed.apply(clickAt(20000, 0.01F));
  EXPECT_NEAR(samples[20000], 0.01 * Exposure::kTarget / 10.0, 1e-5);
}

// Nobody announces what slides: the gain falls once it has been rendered.
TEST(Exposure, FollowsALouderSoundThatNobodyAnnouncedWithin20Milliseconds) {
  Exposed exposed;
  exposed.exposure.expect(0, 0.1);
  std::vector<float> pressure(kSecond, 0.1F);
  std::fill(pressure.begin() + 24000, pressure.end(), 10.0F);
  const std::vector<float> samples = exposed.apply(pressure);
  EXPECT_NEAR(samples[23999], 0.5, 0.01);
  EXPECT_LE(*std::max_element(samples.begin() + 24000 + 960, samples.end()), 0.55F);
}

TEST(Exposure, RisesAgainByThreeDecibelsForEachSecondOfTheSimulation) {
  Exposed exposed;
  exposed.exposure.expect(0, 10.0);
  exposed.exposure.advance(0, 10 * kSecond);
  std::vector<float> pressure(6 * kSecond, 0.01F);
  pressure[0] = 10.0F;
  const std::vector<float> samples = exposed.apply(pressure);
  const auto at = [&](double seconds) {
    return static_cast<double>(samples[static_cast<std::size_t>(seconds * kRate)]);
  };
  EXPECT_NEAR(decibels(at(0.9) / at(0.1)), 0.0, 0.01);  // held
  EXPECT_NEAR(decibels(at(5.5) / at(2.5)), 9.0, 0.1);
}

TEST(Exposure, KeepsStillWhileTheSimulationPauses) {
  Exposed exposed;
  exposed.exposure.expect(0, 10.0);
  exposed.exposure.advance(0, 2 * kSecond);
  exposed.exposure.advance(100 * kSecond, 101 * kSecond);  // on the clock of the samples
  std::vector<float> pressure(20 * kSecond, 0.01F);
  pressure[0] = 10.0F;
  const std::vector<float> samples = exposed.apply(pressure);
  const float paused = samples[3 * kSecond];
  EXPECT_NEAR(samples[19 * kSecond], paused, 1e-4F * paused);
}

TEST(Exposure, NeverRisesByMoreThanItsRange) {
  Exposed exposed;
  exposed.exposure.expect(0, 10.0);
  exposed.exposure.advance(0, 60 * kSecond);
  std::vector<float> pressure(30 * kSecond, 0.001F);
  pressure[0] = 10.0F;
  const std::vector<float> samples = exposed.apply(pressure, 4096);
  EXPECT_NEAR(samples.back(), 0.001 * Exposure::kTarget * Exposure::kRange / 10.0, 1e-6);
}

TEST(Exposure, GivesTheSameBitsForAllSizesOfBlocks) {
  const auto exposedIn = [](std::size_t block) {
    Exposed exposed;
    exposed.exposure.predict(3.0);
    exposed.exposure.expect(700, 2.0);
    exposed.exposure.expect(9000, 40.0);
    exposed.exposure.advance(0, kSecond);
    std::vector<float> pressure = clickAt(700, 2.0F);
    pressure[9000] = 30.0F;
    pressure[9001] = 50.0F;
    return exposed.apply(pressure, block);
  };
  const std::vector<float> expected = exposedIn(512);
  for (const std::size_t block : {1UL, 31UL, 32UL, 1000UL, 48000UL})
    EXPECT_EQ(exposedIn(block), expected) << block;
}

}  // namespace
}  // namespace carom::plugin
