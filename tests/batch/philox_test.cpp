#include "lab/batch/philox.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace carom::lab {
namespace {

using testing::ElementsAre;

constexpr std::uint64_t kOnes = ~std::uint64_t{0};

// Random123 1.14.0, tests/kat_vectors.
TEST(Philox, HasThePublishedVectors) {
  EXPECT_THAT(philox({0, 0, 0, 0}, {0, 0}), ElementsAre(0x16554d9eca36314cU, 0xdb20fe9d672d0fdcU,
                                                        0xd7e772cee186176bU, 0x7e68b68aec7ba23bU));
  EXPECT_THAT(philox({kOnes, kOnes, kOnes, kOnes}, {kOnes, kOnes}),
              ElementsAre(0x87b092c3013fe90bU, 0x438c3c67be8d0224U, 0x9cc7d7c69cd777b6U,
                          0xa09caebf594f0ba0U));
  EXPECT_THAT(
      philox({0x243f6a8885a308d3U, 0x13198a2e03707344U, 0xa4093822299f31d0U, 0x082efa98ec4e6c89U},
             {0x452821e638d01377U, 0xbe5466cf34e90c6cU}),
      ElementsAre(0xa528f45403e61d95U, 0x38c72dbd566e9788U, 0xa5a1610e72fd18b5U,
                  0x57bd43b5e52b7fe6U));
}

TEST(Philox, StreamsTakeTheWordsOfTheirBlocksInTurn) {
  RandomStream stream({.seed = 7, .index = 11, .parameter = 13, .attempt = 17});
  for (std::uint64_t block = 0; block < 3; ++block)
    for (const std::uint64_t word : philox({11, 13, 17, block}, {7, 0}))
      EXPECT_EQ(stream.word(), word);
}

TEST(Philox, NumbersBelowASmallOneAreEquallyFrequent) {
  constexpr std::uint64_t kNumber = 7;
  constexpr int kDraws = 70'000;
  std::array<int, kNumber> counts{};
  RandomStream stream({.seed = 1});
  for (int draw = 0; draw < kDraws; ++draw)
    ++counts.at(stream.below(kNumber));
  // Chi squared with 6 degrees of freedom is below 22.5 in 99.9 % of all cases.
  double chi = 0.0;
  for (const int count : counts)
    chi += (count - 10'000.0) * (count - 10'000.0) / 10'000.0;
  EXPECT_LT(chi, 22.5);
}

TEST(Philox, NumbersBelowALargeOneReachBothHalves) {
  constexpr std::uint64_t kNumber = (std::uint64_t{1} << 63U) + 1;  // half of all words are refused
  RandomStream stream({.seed = 2});
  int low = 0;
  for (int draw = 0; draw < 1000; ++draw) {
    const std::uint64_t number = stream.below(kNumber);
    ASSERT_LT(number, kNumber);
    low += number < kNumber / 2 ? 1 : 0;
  }
  EXPECT_NEAR(low, 500, 60);  // within four deviations
}

TEST(Philox, NormalNumbersHaveTheMomentsOfTheirDistribution) {
  constexpr int kDraws = 100'000;
  RandomStream stream({.seed = 3});
  std::array<double, 5> moments{};
  for (int draw = 0; draw < kDraws; ++draw) {
    double power = 1.0;
    const double value = stream.normal();
    for (double& moment : moments) {
      moment += power / kDraws;
      power *= value;
    }
  }
  // Deviations of the means: sqrt(1), sqrt(2), sqrt(15), sqrt(96) over sqrt(100,000); four of each.
  EXPECT_NEAR(moments[1], 0.0, 4 * 0.0032);
  EXPECT_NEAR(moments[2], 1.0, 4 * 0.0045);
  EXPECT_NEAR(moments[3], 0.0, 4 * 0.0123);
  EXPECT_NEAR(moments[4], 3.0, 4 * 0.0310);
}

TEST(Philox, UniformNumbersFillTheUnitInterval) {
  constexpr std::size_t kBins = 20;
  std::vector<int> bins(kBins);
  RandomStream stream({.seed = 4});
  for (int draw = 0; draw < 20'000; ++draw) {
    const double value = stream.uniform();
    ASSERT_GE(value, 0.0);
    ASSERT_LT(value, 1.0);
    ++bins[static_cast<std::size_t>(value * kBins)];
  }
  double chi = 0.0;  // below 43.8 in 99.9 % of all cases, with 19 degrees of freedom
  for (const int count : bins)
    chi += (count - 1000.0) * (count - 1000.0) / 1000.0;
  EXPECT_LT(chi, 43.8);
}

}  // namespace
}  // namespace carom::lab
