#include "audio/radiation/radiation_bank.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "audio/dsp/spread_kernel.h"

namespace carom {

using namespace audio;

namespace {

using Complex = std::complex<double>;

/// Responses of a filter to bare samples at one frequency.
struct Responses {
  Complex far;
  Complex near;
};

Responses responsesOf(const RadiationFilter& filter, double frequency) {
  const double omega = 2.0 * std::numbers::pi * frequency;
  Responses sum;
  for (std::size_t tap = 0; tap < RadiationFilter::kTaps; ++tap) {
    const double at = static_cast<double>(tap) + static_cast<double>(RadiationFilter::kFirstTap);
    sum.far += filter.far()[tap] * std::polar(1.0, -omega * at);
    sum.near += filter.near()[tap] * std::polar(1.0, -omega * at);
  }
  const Complex poles =
      1.0 - filter.b1() * std::polar(1.0, -omega) - filter.b2() * std::polar(1.0, -2.0 * omega);
  return {sum.far / poles, sum.near / poles};
}

Responses responsesOf(const RadiationBank& bank, const RadiationBank::Mix& mix, double frequency) {
  Responses sum;
  for (std::size_t i = 0; i < mix.count; ++i) {
    const Responses part = responsesOf(bank[mix.filters[i]], frequency);
    sum.far += mix.weights[i] * part.far;
    sum.near += mix.weights[i] * part.near;
  }
  return sum;
}

RadiationBank fullBank() {
  RadiationBank bank(RadiationFilter::Input::bare);
  for (std::size_t i = 0; i < RadiationBank::kOwn; ++i)
    bank.mixOf(1.0 + static_cast<double>(i));
  return bank;
}

TEST(RadiationBank, TheFirstSizesAreExactAndKeepTheirFilters) {
  RadiationBank bank = fullBank();
  const RadiationBank::Mix& first = bank.mixOf(1.0);
  EXPECT_EQ(first.count, 1u);
  EXPECT_EQ(first.weights[0], 1.0);
  EXPECT_EQ(&bank.mixOf(1.0), &first);
  EXPECT_EQ(bank.mixOf(99.0).count, 4u);
  EXPECT_EQ(bank.mixOf(1.0).count, 1u);
}

// The oracle is the sphere's response itself, not another filter.
TEST(RadiationBank, FurtherSizesAreWithin95DecibelsOfTheSpheresResponse) {
  RadiationBank bank = fullBank();
  double worst = 0.0;
  // The corners are those of balls from 30 m at 192 kHz to 0.3 mm at 8 kHz, most of them between
  // the rungs.
  for (double corner = 6e-5; corner < 150.0; corner *= 1.0437) {
    const RadiationBank::Mix& mix = bank.mixOf(corner);
    ASSERT_EQ(mix.count, 4u);
    for (double frequency = 0.002; frequency < kBand; frequency += 0.0103) {
      const RadiationResponse wanted =
          radiationResponse(2.0 * std::numbers::pi * frequency, corner);
      const Responses made = responsesOf(bank, mix, frequency);
      worst = std::max(worst, std::abs(made.far - wanted.far) / std::abs(wanted.far));
      worst = std::max(worst, std::abs(made.near - wanted.near) / std::abs(wanted.near));
    }
  }
  EXPECT_LT(20.0 * std::log10(worst), -95.0);
}

TEST(RadiationBank, AThousandSizesNeedFewFilters) {
  RadiationBank bank = fullBank();
  std::uint32_t last = 0;
  for (int i = 0; i < 1000; ++i) {
    const RadiationBank::Mix& mix = bank.mixOf(0.5 * std::pow(10.0, i / 1000.0));
    last = std::max(last, *std::ranges::max_element(mix.filters));
    double sum = 0.0;
    for (const double weight : mix.weights)
      sum += weight;
    EXPECT_NEAR(sum, 1.0, 1e-14);
  }
  EXPECT_LT(last, 16u + 51u);
}

TEST(RadiationBank, TheCompactModelIsNeverInterpolated) {
  RadiationBank bank = fullBank();
  EXPECT_EQ(bank.mixOf(std::numeric_limits<double>::infinity()).count, 1u);
}

}  // namespace
}  // namespace carom
