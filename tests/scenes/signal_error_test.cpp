#include "lab/report/signal_error.h"

#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/constants.h"

namespace carom::test {

using namespace lab;
using namespace scenes;

namespace {

constexpr std::size_t kFrames = 9600;  // 0.2 s

/// A tone burst around any `time` (s), with a band narrow enough for the samples to hold it.
std::vector<float> burst(double time, double scale = 1.0) {
  std::vector<float> samples;
  samples.reserve(kFrames);
  for (std::size_t frame = 0; frame < kFrames; ++frame) {
    const double t = static_cast<double>(frame) / kRate - time;
    const double envelope = std::exp(-0.5 * std::pow(t / 1e-3, 2.0));
    samples.push_back(
        static_cast<float>(scale * envelope * std::sin(2.0 * std::numbers::pi * 2000.0 * t + 0.3)));
  }
  return samples;
}

std::vector<float> sine(double frequency, double amplitude) {
  std::vector<float> samples;
  samples.reserve(kFrames);
  for (std::size_t frame = 0; frame < kFrames; ++frame) {
    const double phase = 2.0 * std::numbers::pi * frequency * static_cast<double>(frame) / kRate;
    samples.push_back(static_cast<float>(amplitude * std::sin(phase)));
  }
  return samples;
}

TEST(WaveformError, IsTheShareThatIsOff) {
  const Signal exact = {burst(0.05)};
  EXPECT_EQ(waveformError(exact, exact, kFrames), 0.0);
  EXPECT_NEAR(waveformError({burst(0.05, 1.25)}, exact, kFrames), 0.25, 1e-6);
  EXPECT_NEAR(waveformError({burst(0.05, -1.0)}, exact, kFrames), 2.0, 1e-6);
}

TEST(WaveformError, IsOneOfSilenceAndNoneAgainstSilence) {
  const Signal exact = {burst(0.05)};
  EXPECT_EQ(waveformError({std::vector<float>(kFrames)}, exact, kFrames), 1.0);
  EXPECT_EQ(waveformError({{}}, exact, kFrames), 1.0);
  EXPECT_TRUE(std::isnan(waveformError(exact, {std::vector<float>(kFrames)}, kFrames)));
}

TEST(WaveformError, LooksAtTheFirstFramesOnly) {
  Signal other = {burst(0.05)};
  other[0][4800] += 1.0F;
  EXPECT_EQ(waveformError(other, {burst(0.05)}, 4800), 0.0);
  EXPECT_GT(waveformError(other, {burst(0.05)}, 4801), 0.01);
}

TEST(WaveformError, AddsTheEnergiesOfAllChannels) {
  const Signal exact = {burst(0.05), burst(0.1)};
  // One of two channels of equal energy is missing completely.
  EXPECT_NEAR(waveformError({burst(0.05), std::vector<float>(kFrames)}, exact, kFrames),
              std::sqrt(0.5), 1e-5);
}

class Delays : public testing::TestWithParam<double> {};

TEST_P(Delays, AreFoundToAThousandthOfASample) {
  const double delay = GetParam() / kRate;
  const Signal exact = {burst(0.1)};
  const Signal late = {burst(0.1 + delay, 1.1)};
  const AlignedError aligned = alignedError(late, exact, kFrames, kRate);
  EXPECT_NEAR(aligned.delay * kRate, GetParam(), 1e-3);
  EXPECT_NEAR(aligned.error, 0.1, 1e-3);
}

INSTANTIATE_TEST_SUITE_P(AlignedError, Delays,
                         testing::Values(0.0, 0.5, 3.37, -7.81, 100.25, -239.0));

TEST(AlignedError, IsNeverAboveThePlainOne) {
  const Signal exact = {burst(0.1)};
  const Signal other = {burst(0.1 + 0.3 / kRate, 0.9)};
  EXPECT_LE(alignedError(other, exact, kFrames, kRate).error,
            waveformError(other, exact, kFrames) + 1e-5);
}

TEST(AlignedError, MovesAllChannelsTogether) {
  // One ear is early and the other late, so that no common delay corrects both.
  const Signal exact = {burst(0.1), burst(0.1)};
  const Signal turned = {burst(0.1 + 6.0 / kRate), burst(0.1 - 6.0 / kRate)};
  EXPECT_GT(alignedError(turned, exact, kFrames, kRate).error, 0.5);
}

TEST(AlignedError, LooksNoFartherThanTheLongestDelay) {
  const Signal exact = {burst(0.05)};
  const AlignedError aligned = alignedError({burst(0.12)}, exact, kFrames, kRate);
  EXPECT_LE(std::abs(aligned.delay), kLongestDelay + 1.0 / kRate);
  EXPECT_GT(aligned.error, 1.0);
}

TEST(AlignedError, OfSilenceIsOne) {
  EXPECT_EQ(alignedError({std::vector<float>(kFrames)}, {burst(0.1)}, kFrames, kRate).error, 1.0);
}

// Parseval: a sine of amplitude A has the energy A^2 T / 2.
TEST(ThirdOctaves, HoldTheEnergyOfATone) {
  for (const double frequency : {100.0, 1000.0, 10000.0}) {
    double inBand = 0.0;
    double all = 0.0;
    for (const ThirdOctave& band : thirdOctaves({sine(frequency, 0.2)}, kRate)) {
      all += band.energy;
      if (std::abs(band.frequency / frequency - 1.0) < 0.1) inBand = band.energy;
    }
    const double expected = 0.5 * 0.2 * 0.2 * static_cast<double>(kFrames) / kRate;
    EXPECT_NEAR(all, expected, 0.01 * expected) << frequency;
    EXPECT_GT(inBand, 0.95 * all) << frequency;
  }
}

// A single sample a has the same energy in every hertz: 2 a^2 / rate^2.
TEST(ThirdOctaves, OfAnImpulseAreAsLoudAsTheyAreWide) {
  std::vector<float> samples(65536);
  samples[1000] = 3.0F;
  const std::vector<ThirdOctave> bands = thirdOctaves({samples}, kRate);
  ASSERT_GE(bands.size(), 25u);
  for (const ThirdOctave& band : bands) {
    const double width = band.frequency * (std::pow(10.0, 0.05) - std::pow(10.0, -0.05));
    const double expected = width * 2.0 * 9.0 / (kRate * kRate);
    EXPECT_NEAR(band.energy, expected, 0.08 * expected) << band.frequency;
  }
}

TEST(ThirdOctaves, AreTheNominalOnes) {
  const std::vector<ThirdOctave> bands = thirdOctaves({burst(0.1)}, kRate);
  EXPECT_NEAR(bands.front().frequency, 50.0, 0.5);
  EXPECT_NEAR(bands.back().frequency, 16000.0, 200.0);
}

TEST(BandDifferences, AreDecibels) {
  const auto exact = thirdOctaves({burst(0.1)}, kRate);
  const auto louder = thirdOctaves({burst(0.1, 2.0)}, kRate);
  const std::vector<BandDifference> differences = bandDifferences(louder, exact);
  ASSERT_FALSE(differences.empty());
  for (const BandDifference& band : differences)
    EXPECT_NEAR(band.difference, 20.0 * std::log10(2.0), 1e-4) << band.frequency;
  EXPECT_NEAR(rmsOf(differences), 20.0 * std::log10(2.0), 1e-4);
}

TEST(BandDifferences, LeaveOutWhatIsFarBelowTheLoudest) {
  std::vector<ThirdOctave> exact = {{100.0, 1.0}, {125.0, 0.9e-6}, {160.0, 1.1e-6}};
  const std::vector<ThirdOctave> other = {{100.0, 1.0}, {125.0, 1.0}, {160.0, 0.0}};
  const std::vector<BandDifference> differences = bandDifferences(other, exact);
  ASSERT_EQ(differences.size(), 2u);
  EXPECT_EQ(differences[0].difference, 0.0);
  EXPECT_EQ(differences[1].frequency, 160.0);
  EXPECT_EQ(differences[1].difference, -60.0);
}

}  // namespace
}  // namespace carom::test
