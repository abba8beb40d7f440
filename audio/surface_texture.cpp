#include "audio/surface_texture.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <numbers>
#include <string>
#include <utility>

#include <unsupported/Eigen/FFT>

#include "audio/positive.h"

namespace carom {
namespace {

using Complex = std::complex<float>;

constexpr std::size_t kRoughTexels = 512;
constexpr double kTexelsPerCorrelation = 8.0;

/// Counts up and mixes (splitmix64: Steele, Lea, Flood 2014), so that the numbers are the same
/// everywhere.
class Mixer {
 public:
  explicit Mixer(std::uint64_t seed) : state_(seed) {}
  /// Uniform in (0, 1).
  double next() {
    state_ += 0x9E3779B97F4A7C15U;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27U)) * 0x94D049BB133111EBU;
    z ^= z >> 31U;
    return (static_cast<double>(z >> 11U) + 0.5) * 0x1.0p-53;
  }

 private:
  std::uint64_t state_;
};

bool isSide(std::size_t count) {
  return std::has_single_bit(count) && count <= SurfaceTexture::kMostTexels;
}

/// In place, of rows and columns.
void inverseTransform(Eigen::MatrixXcf& values) {
  Eigen::FFT<float> transform;
  transform.SetFlag(Eigen::FFT<float>::Unscaled);
  const auto turn = [&](const Eigen::VectorXcf& line) {
    Eigen::VectorXcf turned(line.size());
    transform.inv(turned, line);
    return turned;
  };
  for (Eigen::Index column = 0; column < values.cols(); ++column)
    values.col(column) = turn(values.col(column));
  for (Eigen::Index row = 0; row < values.rows(); ++row)
    values.row(row) = turn(values.row(row).transpose()).transpose();
}

/// rad per texel, of a component of the transform.
double waveNumber(Eigen::Index index, Eigen::Index count) {
  const Eigen::Index signedIndex = 2 * index > count ? index - count : index;
  return 2.0 * std::numbers::pi * static_cast<double>(signedIndex) / static_cast<double>(count);
}

}  // namespace

Result<SurfaceTexture> SurfaceTexture::ofSlopes(Size size, const Eigen::Vector2d& texel,
                                                std::vector<Slope> slopes) {
  if (!isSide(size.width) || !isSide(size.height))
    return Error{"surface texture: " + std::to_string(size.width) + " x " +
                 std::to_string(size.height) +
                 " texels; expected powers of two, at most 8192 along each side"};
  if (!isPositive(texel.x()) || !isPositive(texel.y()))
    return Error{"surface texture: the texel must be positive (m)"};
  if (slopes.size() != size.width * size.height)
    return Error{"surface texture: expected one slope for each texel"};
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (Slope& slope : slopes) {
    if (!slope.allFinite()) return Error{"surface texture: a slope is no number"};
    slope = slope.cwiseMax(-kSteepest).cwiseMin(kSteepest);
    mean += slope.cast<double>();
  }
  mean /= static_cast<double>(slopes.size());
  for (Slope& slope : slopes)
    slope -= mean.cast<float>();
  SurfaceTexture texture;
  texture.size_ = size;
  texture.texel_ = texel;
  texture.width_ = std::sqrt(texel.x() * texel.y());
  texture.levels_.push_back({size, texel.cwiseInverse(), 0.0, std::move(slopes)});
  texture.addLevels();
  return texture;
}

void SurfaceTexture::addLevels() {
  while (levels_.back().size.width > 1 || levels_.back().size.height > 1) {
    const Level& fine = levels_.back();
    // A side of one texel stays: both halves of the mean are the same texel then.
    const std::size_t alongU = std::min<std::size_t>(fine.size.width, 2);
    const std::size_t alongV = std::min<std::size_t>(fine.size.height, 2);
    const Eigen::Vector2d halved(static_cast<double>(alongU), static_cast<double>(alongV));
    Level coarse{{fine.size.width / alongU, fine.size.height / alongV},
                 fine.perMetre.cwiseQuotient(halved),
                 0.0,
                 {}};
    coarse.slopes.reserve(coarse.size.width * coarse.size.height);
    for (std::size_t v = 0; v < coarse.size.height; ++v) {
      for (std::size_t u = 0; u < coarse.size.width; ++u) {
        const auto at = [&](std::size_t du, std::size_t dv) {
          return fine.slopes[(alongV * v + dv) * fine.size.width + alongU * u + du];
        };
        coarse.slopes.emplace_back(0.25F * (at(0, 0) + at(alongU - 1, 0) + at(0, alongV - 1) +
                                            at(alongU - 1, alongV - 1)));
      }
    }
    levels_.push_back(std::move(coarse));
  }
  for (Level& level : levels_) {
    double sum = 0.0;
    for (const Slope& slope : level.slopes)
      sum += static_cast<double>(slope.squaredNorm());
    level.rms = std::sqrt(0.5 * sum / static_cast<double>(level.slopes.size()));
  }
}

Result<SurfaceTexture> SurfaceTexture::rough(const Roughness& roughness, std::uint64_t seed) {
  if (!(roughness.rmsHeight >= 0.0) || std::isinf(roughness.rmsHeight))
    return Error{"roughness: the rms height must be at least 0 (m)"};
  if (!isPositive(roughness.correlationLength))
    return Error{"roughness: the correlation length must be positive (m)"};
  if (!(roughness.hurst > 0.0 && roughness.hurst <= 1.0))
    return Error{"roughness: the Hurst exponent must be above 0 and at most 1"};
  constexpr auto kCount = static_cast<Eigen::Index>(kRoughTexels);
  // Random phases; both slopes at once, as real and imaginary parts, since the height is real.
  Mixer random(seed);
  Eigen::MatrixXcf heights = Eigen::MatrixXcf::Zero(kCount, kCount);
  double power = 0.0;
  for (Eigen::Index column = 0; column < kCount; ++column) {
    for (Eigen::Index row = 0; row < kCount; ++row) {
      const double phase = 2.0 * std::numbers::pi * random.next();
      const Eigen::Vector2d q(waveNumber(row, kCount), waveNumber(column, kCount));
      const double length = q.norm() * kTexelsPerCorrelation;
      const bool isHighest = 2 * row == kCount || 2 * column == kCount;
      if (length == 0.0 || isHighest) continue;
      const double amplitude = std::pow(std::max(1.0, length), -(1.0 + roughness.hurst));
      heights(row, column) = Complex(std::polar(amplitude, phase));
      power += amplitude * amplitude;
    }
  }
  // The real part of a sum of waves has half of their power.
  const double scale = roughness.rmsHeight / std::sqrt(0.5 * power);
  const double texel = roughness.correlationLength / kTexelsPerCorrelation;
  std::vector<Slope> slopes(kRoughTexels * kRoughTexels);
  for (const Eigen::Index axis : {0, 1}) {
    Eigen::MatrixXcf waves = heights;
    for (Eigen::Index column = 0; column < kCount; ++column)
      for (Eigen::Index row = 0; row < kCount; ++row)
        waves(row, column) *= Complex(
            0.0F, static_cast<float>(scale / texel * waveNumber(axis == 0 ? row : column, kCount)));
    inverseTransform(waves);
    for (Eigen::Index column = 0; column < kCount; ++column)
      for (Eigen::Index row = 0; row < kCount; ++row)
        slopes[static_cast<std::size_t>(column * kCount + row)][axis] = waves(row, column).real();
  }
  return ofSlopes({kRoughTexels, kRoughTexels}, {texel, texel}, std::move(slopes));
}

Eigen::Vector2d SurfaceTexture::slope(const Eigen::Vector2d& at, double width) const {
  // A texel of width w averages about as a look of width w does.
  const double depth = std::log2(std::max(width / width_, 1.0));
  const double last = static_cast<double>(levels_.size() - 1);
  if (depth >= last) return sample(levels_.back(), at);
  const auto level = static_cast<std::size_t>(depth);
  const double share = depth - static_cast<double>(level);
  if (share == 0.0) return sample(levels_[level], at);
  return (1.0 - share) * sample(levels_[level], at) + share * sample(levels_[level + 1], at);
}

/// Quadratic B-splines: the slope has a slope everywhere, so that a path over texels has no corners
/// that would sound.
Eigen::Vector2d SurfaceTexture::sample(const Level& level, const Eigen::Vector2d& at) const {
  const auto weightsAt = [](double place, std::size_t count, std::array<std::size_t, 3>& index) {
    const double nearest = std::floor(place);
    const double t = place - nearest - 0.5;
    const double wrapped =
        nearest - std::floor(nearest / static_cast<double>(count)) * static_cast<double>(count);
    const auto middle = std::min(static_cast<std::size_t>(std::max(0.0, wrapped)), count - 1);
    const std::size_t mask = count - 1;
    index = {(middle + mask) & mask, middle, (middle + 1) & mask};
    return std::array{0.5 * (0.5 - t) * (0.5 - t), 0.75 - t * t, 0.5 * (0.5 + t) * (0.5 + t)};
  };
  std::array<std::size_t, 3> u{};
  std::array<std::size_t, 3> v{};
  const auto alongU = weightsAt(at.x() * level.perMetre.x(), level.size.width, u);
  const auto alongV = weightsAt(at.y() * level.perMetre.y(), level.size.height, v);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (std::size_t row = 0; row < 3; ++row) {
    const Slope* line = &level.slopes[v[row] * level.size.width];
    for (std::size_t column = 0; column < 3; ++column)
      sum += alongV[row] * alongU[column] * line[u[column]].cast<double>();
  }
  return sum;
}

double SurfaceTexture::rmsSlope(double width) const {
  const double depth = std::log2(std::max(width / width_, 1.0));
  const double last = static_cast<double>(levels_.size() - 1);
  if (depth >= last) return levels_.back().rms;
  const auto level = static_cast<std::size_t>(depth);
  const double share = depth - static_cast<double>(level);
  return (1.0 - share) * levels_[level].rms + share * levels_[level + 1].rms;
}

}  // namespace carom
