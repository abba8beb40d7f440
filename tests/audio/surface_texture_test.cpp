#include "carom/audio/surface_texture.h"

#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace carom {
namespace {

using testing::HasSubstr;
using Slope = SurfaceTexture::Slope;

/// A texture of `periods` waves along u, of slope amplitude 1.
SurfaceTexture waves(std::size_t texels, double texel, double periods) {
  std::vector<Slope> slopes;
  for (std::size_t v = 0; v < texels; ++v)
    for (std::size_t u = 0; u < texels; ++u)
      slopes.emplace_back(static_cast<float>(std::cos(2.0 * std::numbers::pi * periods *
                                                      (static_cast<double>(u) + 0.5) /
                                                      static_cast<double>(texels))),
                          0.0F);
  return *SurfaceTexture::ofSlopes({texels, texels}, {texel, texel}, slopes);
}

TEST(SurfaceTexture, FollowsAWaveBetweenItsTexels) {
  const double texel = 1e-3;
  const SurfaceTexture texture = waves(64, texel, 2.0);
  Random random(1);
  for (int trial = 0; trial < 100; ++trial) {
    const Eigen::Vector2d at{random.between(-1.0, 1.0), random.between(-1.0, 1.0)};
    const double wave = std::cos(2.0 * std::numbers::pi * at.x() / (32.0 * texel));
    // The spline averages over some one and a half texels: it keeps 1 - (2 pi / 32)^2 / 8 of the
    // wave.
    EXPECT_NEAR(texture.slope(at, 0.0).x(), wave, 6e-3);
    EXPECT_NEAR(texture.slope(at, 0.0).y(), 0.0, 1e-6);
  }
}

TEST(SurfaceTexture, RepeatsInBothDirections) {
  Random random(2);
  std::vector<Slope> slopes;
  slopes.reserve(std::size_t{64} * 64);
  for (int index = 0; index < 64 * 64; ++index)
    slopes.emplace_back(0.01F * random.inCube().head<2>().cast<float>());
  const SurfaceTexture texture = *SurfaceTexture::ofSlopes({64, 64}, {1e-5, 1e-5}, slopes);
  const double period = 64e-5;
  for (int trial = 0; trial < 100; ++trial) {
    const Eigen::Vector2d at{random.between(0.0, period), random.between(0.0, period)};
    const double width = random.between(0.0, 20.0) * texture.texel().x();
    const Eigen::Vector2d there = texture.slope(at + period * Eigen::Vector2d(-3.0, 2.0), width);
    EXPECT_LT((texture.slope(at, width) - there).norm(), 1e-9);
  }
}

TEST(SurfaceTexture, AWideLookAveragesShortWavesOut) {
  const double texel = 1e-3;
  const SurfaceTexture texture = waves(256, texel, 32.0);  // wavelength: 8 texels
  EXPECT_GT(texture.steepest(), 0.9);
  EXPECT_LE(texture.steepest(), 1.0);
  for (int step = 0; step < 50; ++step) {
    const Eigen::Vector2d at(0.37e-3 * step, 0.0);
    EXPECT_LT(std::abs(texture.slope(at, 16.0 * texel).x()), 1e-6);
    EXPECT_LT(std::abs(texture.slope(at, 1.0).x()), 1e-6);  // the look is wider than the texture
  }
}

// The slopes belong to one height: around a closed way they add up to zero. The heights along lines
// have the root mean square that was asked for.
TEST(SurfaceTexture, RoughSurfaceHasItsHeightAndIsOneSurface) {
  const Roughness roughness{3e-6, 2e-4, 0.8};
  const SurfaceTexture texture = *SurfaceTexture::rough(roughness, 1);
  const double step = texture.texel().x() / 8.0;
  // Lines along `u` repeat.
  const Eigen::Vector2d u = Eigen::Vector2d(2.0, std::sqrt(5.0) - 1.0).normalized();
  const Eigen::Vector2d v(-u.y(), u.x());
  double square = 0.0;
  std::size_t count = 0;
  for (int line = 0; line < 64; ++line) {
    const Eigen::Vector2d from = 8.37 * line * texture.texel().x() * v;
    std::vector<double> heights = {0.0};
    double mean = 0.0;
    for (int index = 0; index < 512 * 8; ++index) {
      heights.push_back(heights.back() +
                        step * texture.slope(from + (index + 0.5) * step * u, 0.0).dot(u));
      mean += heights.back();
    }
    EXPECT_NEAR(heights.back(), 0.0, 1e-3 * roughness.rmsHeight);
    mean /= 512.0 * 8.0;
    for (const double height : heights)
      square += (height - mean) * (height - mean);
    count += heights.size();
  }
  // A line lacks the waves whose crests run along it, so that the root mean square is only close.
  EXPECT_NEAR(std::sqrt(square / static_cast<double>(count)), roughness.rmsHeight,
              0.05 * roughness.rmsHeight);
  double around = 0.0;
  for (int index = 0; index < 1000; ++index) {
    const double at = (index + 0.5) / 1000.0 * 1e-3;
    around += texture.slope({at, 0.0}, 0.0).x() + texture.slope({1e-3, at}, 0.0).y() -
              texture.slope({at, 1e-3}, 0.0).x() - texture.slope({0.0, at}, 0.0).y();
  }
  // The spline of the texels is only nearly the gradient of a height.
  EXPECT_NEAR(around * 1e-6, 0.0, 0.1 * roughness.rmsHeight);
}

TEST(SurfaceTexture, RoughnessIsTheSameForASeedAndAnotherForAnother) {
  const Roughness roughness{1e-6, 1e-4, 0.8};
  const Eigen::Vector2d at(1.234e-3, 5.678e-3);
  const Eigen::Vector2d one = SurfaceTexture::rough(roughness, 5)->slope(at, 0.0);
  EXPECT_EQ(one, SurfaceTexture::rough(roughness, 5)->slope(at, 0.0));
  EXPECT_GT((one - SurfaceTexture::rough(roughness, 6)->slope(at, 0.0)).norm(), 1e-6);
}

TEST(SurfaceTexture, SaysWhatItCannotBeMadeOf) {
  const std::vector<Slope> four(4, Slope::Zero());
  const auto refusal = [](SurfaceTexture::Size size, double texel, std::vector<Slope> slopes) {
    const auto made = SurfaceTexture::ofSlopes(size, {texel, 1e-3}, std::move(slopes));
    return made ? std::string() : made.error().message;
  };
  EXPECT_EQ(refusal({2, 2}, 1e-3, four), "");
  EXPECT_THAT(refusal({3, 2}, 1e-3, std::vector<Slope>(6, Slope::Zero())),
              HasSubstr("powers of two"));
  EXPECT_THAT(refusal({0, 0}, 1e-3, {}), HasSubstr("powers of two"));
  EXPECT_THAT(refusal({2, 2}, 0.0, four), HasSubstr("texel must be positive"));
  EXPECT_THAT(refusal({2, 2}, 1e-300, four), HasSubstr("from 1e-12 to 1e6 (m)"));
  EXPECT_THAT(refusal({2, 2}, 1e300, four), HasSubstr("from 1e-12 to 1e6 (m)"));
  EXPECT_THAT(refusal({2, 2}, 1e-3, {}), HasSubstr("one slope for each"));
  std::vector<Slope> bad = four;
  bad[2].y() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(refusal({2, 2}, 1e-3, bad), HasSubstr("no number"));
  EXPECT_FALSE(SurfaceTexture::rough({-1.0, 1e-4, 0.8}, 1));
  EXPECT_FALSE(SurfaceTexture::rough({1e-6, 0.0, 0.8}, 1));
  EXPECT_FALSE(SurfaceTexture::rough({1e-6, 1e-4, 0.0}, 1));
}

}  // namespace
}  // namespace carom
