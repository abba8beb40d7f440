#include "carom/audio/surface_texture.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <map>
#include <numbers>
#include <string>
#include <utility>

#include <unsupported/Eigen/FFT>

#include "audio/model/immortal.h"
#include "audio/model/mutex.h"
#include "audio/model/positive.h"

namespace carom {

using namespace audio;

namespace {

using Coefficient = std::complex<float>;

constexpr std::size_t kRoughTexels = 512;
constexpr double kTexelsPerCorrelation = 8.0;

/// Texels: farther away a double cannot tell them apart.
constexpr double kFarthestCoordinate = 0x1.0p+53;

/// A generator of random numbers (splitmix64: Steele, Lea, Flood 2014) that are the same
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

/// True for sizes (m) that can be divided by and multiplied with, for areas and slopes alike.
bool isTexel(double size) {
  return size >= 1e-12 && size <= 1e6;
}

/// Transforms columns and rows of a square in place.
void inverseTransform(Eigen::MatrixXcf& values) {
  Eigen::FFT<float> transform;
  transform.SetFlag(Eigen::FFT<float>::Unscaled);
  Eigen::VectorXcf turned(values.rows());
  for ([[maybe_unused]] const int direction : {0, 1}) {
    for (Eigen::Index column = 0; column < values.cols(); ++column) {
      transform.inv(turned.data(), values.col(column).data(), values.rows());
      values.col(column) = turned;
    }
    values.transposeInPlace();
  }
}

/// Correlation between what two levels show of a wave: what the coarser one shows near its texels
/// is mostly folded from shorter waves.
constexpr double kAlike = 0.3;
/// Lines of a level, of each direction, of which the spectrum is the mean; at most.
constexpr std::size_t kMeasuredLines = 64;

/// Share of the power of a wave that the spline between texels leaves, at `turns` waves per texel.
double leftBySpline(double turns) {
  const double phase = std::numbers::pi * turns;
  return phase == 0.0 ? 1.0 : std::pow(std::sin(phase) / phase, 6.0);
}

/// Wave number (rad per texel) of a component of the transform.
double waveNumber(Eigen::Index index, Eigen::Index count) {
  const Eigen::Index signedIndex = 2 * index > count ? index - count : index;
  return 2.0 * std::numbers::pi * static_cast<double>(signedIndex) / static_cast<double>(count);
}

/// Amplitudes of waves by the counts along both sides, of either sign: a power of the wave number
/// beyond that of the correlation length.
class WaveAmplitudes {
 public:
  WaveAmplitudes(Eigen::Index count, double hurst) : table_(count / 2, count / 2) {
    for (Eigen::Index j = 0; j < table_.cols(); ++j) {
      for (Eigen::Index i = 0; i <= j; ++i) {
        const Vec2 q(waveNumber(i, count), waveNumber(j, count));
        const double length = q.norm() * kTexelsPerCorrelation;
        table_(i, j) = table_(j, i) = std::pow(std::max(1.0, length), -(1.0 + hurst));
      }
    }
    table_(0, 0) = 0.0;
  }
  /// 0 for the highest waves, which have no sign.
  double of(Eigen::Index row, Eigen::Index column) const {
    const Eigen::Index half = table_.rows();
    if (row == half || column == half) return 0.0;
    return table_(row < half ? row : 2 * half - row, column < half ? column : 2 * half - column);
  }

 private:
  Eigen::MatrixXd table_;
};

}  // namespace

Status SurfaceTexture::check(Size size, const Vec2& texel, std::span<const Slope> slopes) {
  if (!isSide(size.width) || !isSide(size.height))
    return Error{"surface texture: " + std::to_string(size.width) + " x " +
                 std::to_string(size.height) +
                 " texels; expected powers of two, at most 8192 along each side"};
  if (!isTexel(texel.x()) || !isTexel(texel.y()))
    return Error{"surface texture: the texel must be positive, from 1e-12 to 1e6 (m)"};
  if (slopes.size() != size.width * size.height)
    return Error{"surface texture: expected one slope for each texel"};
  for (const Slope& slope : slopes)
    if (!slope.allFinite()) return Error{"surface texture: a slope is no number"};
  return std::monostate{};
}

SurfaceTexture SurfaceTexture::ofCentred(Size size, const Vec2& texel, std::vector<Slope> slopes) {
  auto texels = std::make_shared<Texels>();
  texels->texel = texel;
  texels->width = std::sqrt(texel.x() * texel.y());
  texels->levels.push_back({size, texel.cwiseInverse(), 0.0, 0.0, std::move(slopes)});
  addLevels(*texels);
  SurfaceTexture texture;
  texture.texels_ = std::move(texels);
  return texture;
}

Result<SurfaceTexture> SurfaceTexture::ofSlopes(Size size, const Vec2& texel,
                                                std::vector<Slope> slopes) {
  if (const Status valid = check(size, texel, slopes); !valid) return valid.error();
  Vec2 mean = Vec2::Zero();
  for (Slope& slope : slopes) {
    slope = slope.cwiseMax(-kSteepest).cwiseMin(kSteepest);
    mean += slope.cast<double>();
  }
  mean /= static_cast<double>(slopes.size());
  for (Slope& slope : slopes)
    slope -= mean.cast<float>();
  return ofCentred(size, texel, std::move(slopes));
}

void SurfaceTexture::addLevels(Texels& texels) {
  std::vector<Level>& levels = texels.levels;
  while (levels.back().size.width > 1 || levels.back().size.height > 1) {
    const Level& fine = levels.back();
    // A side of one texel stays: both halves of the mean are the same texel then.
    const std::size_t alongU = std::min<std::size_t>(fine.size.width, 2);
    const std::size_t alongV = std::min<std::size_t>(fine.size.height, 2);
    const Vec2 halved(static_cast<double>(alongU), static_cast<double>(alongV));
    Level coarse{{fine.size.width / alongU, fine.size.height / alongV},
                 fine.perMetre.cwiseQuotient(halved),
                 0.0,
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
    levels.push_back(std::move(coarse));
  }
  measure(texels);
}

void SurfaceTexture::measure(Texels& texels) {
  double finer = 0.0;  // mean square of the slopes of the level before
  for (std::size_t index = 0; index < texels.levels.size(); ++index) {
    Level& level = texels.levels[index];
    level.curvature = curvatureOf(level);
    double square = 0.0;
    for (const Slope& slope : level.slopes)
      square += static_cast<double>(slope.squaredNorm());
    square /= static_cast<double>(level.slopes.size());
    if (index > 0) {
      // Halving texels of width w loses the waves of length 2 w to 4 w.
      const double width = texels.width * std::exp2(static_cast<double>(index - 1));
      const double waveNumber = 2.0 * std::numbers::pi / (3.0 * width);
      level.lost = std::hypot(texels.levels[index - 1].lost,
                              std::sqrt(std::max(0.0, finer - square)) / waveNumber);
    }
    measureSpectrum(level, texels.width * std::exp2(static_cast<double>(index)));
    finer = square;
  }
  for (const Slope& slope : texels.levels.front().slopes)
    texels.steepest = std::max(texels.steepest, static_cast<double>(slope.norm()));
}

/// Returns the rms curvature (1/m) along a line: the mean over both directions, from texel to
/// texel.
double SurfaceTexture::curvatureOf(const Level& level) {
  const auto [width, height] = level.size;
  double sum = 0.0;
  for (std::size_t v = 0; v < height; ++v) {
    for (std::size_t u = 0; u < width; ++u) {
      const Slope& here = level.slopes[v * width + u];
      const Slope& right = level.slopes[v * width + (u + 1) % width];
      const Slope& above = level.slopes[(v + 1) % height * width + u];
      const double alongU = static_cast<double>(right.x() - here.x()) * level.perMetre.x();
      const double alongV = static_cast<double>(above.y() - here.y()) * level.perMetre.y();
      sum += 0.5 * (alongU * alongU + alongV * alongV);
    }
  }
  return std::sqrt(sum / static_cast<double>(width * height));
}

Status validate(const Roughness& roughness) {
  if (!isPositive(roughness.correlationLength))
    return Error{"the correlation length must be positive (m)"};
  if (!(roughness.rmsHeight >= 0.0 && roughness.rmsHeight <= roughness.correlationLength))
    return Error{"the rms height must be at least 0 and at most the correlation length (m)"};
  if (!(roughness.hurst > 0.0 && roughness.hurst <= 1.0))
    return Error{"the Hurst exponent must be above 0 and at most 1"};
  return std::monostate{};
}

Result<SurfaceTexture> SurfaceTexture::rough(const Roughness& roughness, std::uint64_t seed) {
  if (const Status valid = validate(roughness); !valid)
    return Error{"roughness: " + valid.error().message};
  SurfaceTexture texture;
  texture.texels_ = roughTexels(roughness.hurst, seed);
  texture.scale_ = roughness.correlationLength;
  texture.steepness_ = roughness.rmsHeight / roughness.correlationLength;
  // The pattern is turned by the golden ratio: a path along an axis of a body crosses it elsewhere
  // each time, so that its repetition is no tone.
  texture.axis_ = Vec2(1.0, 0.5 * (std::sqrt(5.0) - 1.0)).normalized();
  return texture;
}

/// Returns texels of rms height 1 and correlation length 1, which are shared as long as any texture
/// has them. Those made last are kept even if none has: the next world most often needs the same.
std::shared_ptr<const SurfaceTexture::Texels> SurfaceTexture::roughTexels(double hurst,
                                                                          std::uint64_t seed) {
  struct Known {
    std::map<std::pair<double, std::uint64_t>, std::weak_ptr<const Texels>> all;
    std::array<std::shared_ptr<const Texels>, 2> kept;  // 3 MB each, the latest first
  };
  static audio::Mutex mutex;
  static Known& known = audio::immortal([] { return Known(); });
  const audio::MutexLock lock(mutex);
  std::weak_ptr<const Texels>& place = known.all[{hurst, seed}];
  if (auto texels = place.lock()) return texels;
  std::shared_ptr<const Texels> made = makeRoughTexels(hurst, seed);
  place = made;
  known.kept = {made, known.kept.front()};
  return made;
}

std::shared_ptr<const SurfaceTexture::Texels> SurfaceTexture::makeRoughTexels(double hurst,
                                                                              std::uint64_t seed) {
  constexpr auto kCount = static_cast<Eigen::Index>(kRoughTexels);
  // Waves of random phases; the height is the real part of their sum.
  Mixer random(seed);
  const WaveAmplitudes amplitudes(kCount, hurst);
  Eigen::MatrixXcf heights(kCount, kCount);
  double power = 0.0;
  for (Eigen::Index column = 0; column < kCount; ++column) {
    for (Eigen::Index row = 0; row < kCount; ++row) {
      const double phase = 2.0 * std::numbers::pi * random.next();
      const double amplitude = amplitudes.of(row, column);
      heights(row, column) = Coefficient(std::polar(amplitude, phase));
      power += amplitude * amplitude;
    }
  }
  // The real part of a sum of waves has half of their power.
  const double scale = 1.0 / std::sqrt(0.5 * power);
  const double texel = 1.0 / kTexelsPerCorrelation;
  // One transform has both slopes: that along u as its real part, that along v as the imaginary.
  Eigen::MatrixXcf waves(kCount, kCount);
  Eigen::VectorXf steepness(kCount);
  for (Eigen::Index index = 0; index < kCount; ++index)
    steepness[index] = static_cast<float>(0.5 * scale / texel * waveNumber(index, kCount));
  for (Eigen::Index column = 0; column < kCount; ++column) {
    const Eigen::Index oppositeColumn = (kCount - column) % kCount;
    for (Eigen::Index row = 0; row < kCount; ++row) {
      const Coefficient opposite = std::conj(heights((kCount - row) % kCount, oppositeColumn));
      waves(row, column) =
          Coefficient(-steepness[column], steepness[row]) * (heights(row, column) + opposite);
    }
  }
  inverseTransform(waves);
  std::vector<Slope> slopes(kRoughTexels * kRoughTexels);
  for (std::size_t i = 0; i < slopes.size(); ++i)
    slopes[i] = {waves.data()[i].real(), waves.data()[i].imag()};
  auto texels = std::make_shared<Texels>();
  texels->texel = {texel, texel};
  texels->width = texel;
  texels->levels.push_back(
      {{kRoughTexels, kRoughTexels}, texels->texel.cwiseInverse(), 0.0, 0.0, std::move(slopes)});
  addLevels(*texels);
  return texels;
}

SurfaceTexture::Look SurfaceTexture::look(double width) const {
  // A texel is a mean over itself, and the spline between texels one over three of them: together
  // they have the variance of a mean over two.
  const double depth = std::log2(std::max(0.5 * width / (scale_ * texels_->width), 1.0));
  const double last = static_cast<double>(texels_->levels.size() - 1);
  if (depth >= last) return {.fine = &texels_->levels.back()};
  const auto level = static_cast<std::size_t>(depth);
  const double share = depth - static_cast<double>(level);
  const Level* fine = &texels_->levels[level];
  return {.fine = fine, .coarse = share > 0.0 ? fine + 1 : nullptr, .share = share};
}

double SurfaceTexture::widthOf(double curvature) const {
  const std::vector<Level>& levels = texels_->levels;
  const double wanted = curvature * scale_ / steepness_;  // before scaling, as in texels_
  if (levels.front().curvature <= wanted) return 0.0;
  std::size_t level = 1;
  while (level + 1 < levels.size() && levels[level].curvature > wanted)
    ++level;
  // Between two levels the curvature is a power of the width.
  const double finer = levels[level - 1].curvature;
  const double coarser = std::max(levels[level].curvature, 1e-9 * finer);
  const double share = std::clamp(std::log(finer / wanted) / std::log(finer / coarser), 0.0, 1.0);
  return 2.0 * scale_ * texels_->width * std::exp2(static_cast<double>(level - 1) + share);
}

double SurfaceTexture::widthOf(const Look& look) const {
  const auto level = static_cast<double>(look.fine - texels_->levels.data());
  return scale_ * texels_->width * std::exp2(level);
}

double SurfaceTexture::heightBelow(double width) const {
  const Look seen = look(width);
  double lost = seen.fine->lost;
  if (seen.coarse != nullptr) lost += seen.share * (seen.coarse->lost - lost);
  return steepness_ * scale_ * lost;
}

void SurfaceTexture::addSlopes(const Look& look, double longest, double factor,
                               std::span<double> powers) const {
  const double scaled = 10.0 * std::log10(longest / (scale_ * texels_->width));
  const std::ptrdiff_t finest = look.fine - texels_->levels.data();
  const auto placeIn = [&](std::ptrdiff_t level) {
    return scaled - 10.0 * std::numbers::ln2 / std::numbers::ln10 * static_cast<double>(level) -
           Level::kShortest;
  };
  const double fine = placeIn(finest);
  const double coarse = placeIn(finest + 1);
  const double steep = factor * steepness_ * steepness_;
  for (std::size_t band = 0; band < powers.size(); ++band) {
    const auto shorter = static_cast<double>(band);
    const double finer = (1.0 - look.share) * look.fine->around(fine - shorter);
    const double coarser =
        look.coarse != nullptr ? look.share * look.coarse->around(coarse - shorter) : 0.0;
    powers[band] += steep * (finer * finer + coarser * coarser + 2.0 * kAlike * finer * coarser);
  }
}

/// Returns the amplitude around a length, in third octaves from the shortest on.
double SurfaceTexture::Level::around(double place) const {
  if (!(place >= 0.0 && place < static_cast<double>(kBands - 1))) return 0.0;
  const auto index = static_cast<std::size_t>(place);
  const auto share = static_cast<float>(place - static_cast<double>(index));
  return static_cast<double>(spectrum[index] + share * (spectrum[index + 1] - spectrum[index]));
}

/// Wave numbers (turns per texel) between the bands of a level's spectrum, the highest first, where
/// texels along the lines are `stretch` times as wide as a texel is.
std::array<double, SurfaceTexture::Level::kBands + 1> SurfaceTexture::Level::edges(double stretch) {
  std::array<double, kBands + 1> edges{};
  for (std::size_t band = 0; band < edges.size(); ++band)
    edges[band] = stretch * std::pow(10.0, -0.1 * (static_cast<double>(band) + kShortest - 0.5));
  return edges;
}

/// Measures the spectrum of the slopes along lines of texels, as the spline shows them.
void SurfaceTexture::measureSpectrum(Level& level, double width) {
  const std::array<std::size_t, 2> sides = {level.size.width, level.size.height};
  Eigen::FFT<float> transform;
  for (const std::size_t axis : {0U, 1U}) {
    const std::size_t length = sides[axis];
    const std::size_t across = sides[1 - axis];
    if (length < 4) continue;
    const std::size_t stride = std::max<std::size_t>(1, across / kMeasuredLines);
    std::vector<double> powers(length / 2);
    std::vector<float> line(length);
    std::vector<Coefficient> waves;
    for (std::size_t place = 0; place < across; place += stride) {
      for (std::size_t i = 0; i < length; ++i)
        line[i] = level.slopes[axis == 0 ? place * length + i : i * across + place]
                              [static_cast<Eigen::Index>(axis)];
      transform.fwd(waves, line);
      for (std::size_t wave = 1; wave < powers.size(); ++wave)
        powers[wave] += static_cast<double>(std::norm(waves[wave]));
    }
    const auto count = static_cast<double>(length);
    // Half for each of the two directions.
    const double scale =
        1.0 / (count * count * static_cast<double>((across + stride - 1) / stride));
    const double stretch =
        width > 0.0 ? 1.0 / (level.perMetre[static_cast<Eigen::Index>(axis)] * width) : 1.0;
    const auto edges = Level::edges(stretch);
    // Spreads the power of a wave evenly over the wave numbers (turns per texel) around it.
    const auto addWave = [&](double turns, double power) {
      const double from = turns - 0.5 / count;
      const double to = turns + 0.5 / count;
      for (std::size_t band = 0; band < Level::kBands && edges[band] > from; ++band) {
        const double overlap = std::min(to, edges[band]) - std::max(from, edges[band + 1]);
        if (overlap > 0.0) level.spectrum[band] += static_cast<float>(power * overlap * count);
      }
    };
    for (std::size_t wave = 1; wave < powers.size(); ++wave) {
      const double turns = static_cast<double>(wave) / count;
      // The spline shows a wave, and its images on both sides of that of the texels.
      for (const double seen : {turns, 1.0 - turns, 1.0 + turns})
        addWave(seen, scale * powers[wave] * leftBySpline(seen));
    }
  }
  for (float& amplitude : level.spectrum)
    amplitude = std::sqrt(amplitude);
}

/// Returns a vector along the axes of the texels.
Vec2 SurfaceTexture::turned(const Vec2& v) const {
  return {axis_.dot(v), axis_.x() * v.y() - axis_.y() * v.x()};
}

Vec2 SurfaceTexture::slope(const Look& look, const Vec2& at) const {
  const Vec2 place = turned(at) / scale_;
  const auto on = [&place](const Level& level) {
    return Vec2(level.atTexels(place.cwiseProduct(level.perMetre)).cast<double>());
  };
  Vec2 slope = on(*look.fine);
  if (look.coarse != nullptr) slope = (1.0 - look.share) * slope + look.share * on(*look.coarse);
  return steepness_ * Vec2(axis_.x() * slope.x() - axis_.y() * slope.y(),
                           axis_.y() * slope.x() + axis_.x() * slope.y());
}

SurfaceTexture::Line SurfaceTexture::line(const Look& look, const Vec2& from, const Vec2& along,
                                          const Vec2& climb) const {
  const auto on = [&](const Level* level, double share) {
    const Vec2 perMetre = level->perMetre / scale_;
    return Line::OnLevel{.level = level,
                         .begin = turned(from).cwiseProduct(perMetre),
                         .along = turned(along).cwiseProduct(perMetre),
                         .climb = (steepness_ * share * turned(climb)).cast<float>()};
  };
  Line line;
  line.fine_ = on(look.fine, 1.0 - look.share);
  if (look.coarse != nullptr) line.coarse_ = on(look.coarse, look.share);
  return line;
}

double SurfaceTexture::Line::at(double share) const {
  const auto climbed = [share](const OnLevel& on) {
    return static_cast<double>(on.level->atTexels(on.begin + share * on.along).dot(on.climb));
  };
  return climbed(fine_) + (coarse_.level != nullptr ? climbed(coarse_) : 0.0);
}

/// Interpolates by quadratic B-splines: the slope is differentiable everywhere, so that a path over
/// texels has no corners that would sound.
SurfaceTexture::Slope SurfaceTexture::Level::atTexels(const Vec2& place) const {
  struct Taps {
    std::array<std::size_t, 3> index;
    std::array<float, 3> weight;
  };
  const auto tapsAt = [](double coordinate, std::size_t count) {
    const double bounded = std::clamp(coordinate, -kFarthestCoordinate, kFarthestCoordinate);
    auto below = static_cast<std::int64_t>(bounded);  // std::floor is a call where SSE4.1 is not
    below -= static_cast<double>(below) > bounded ? 1 : 0;
    const auto t = static_cast<float>(coordinate - static_cast<double>(below)) - 0.5F;
    // Counts are powers of two, so the mask wraps indices below zero, too.
    const auto middle = static_cast<std::size_t>(below);
    const std::size_t mask = count - 1;
    return Taps{{(middle - 1) & mask, middle & mask, (middle + 1) & mask},
                {0.5F * (0.5F - t) * (0.5F - t), 0.75F - t * t, 0.5F * (0.5F + t) * (0.5F + t)}};
  };
  const Taps u = tapsAt(place.x(), size.width);
  const Taps v = tapsAt(place.y(), size.height);
  Slope sum = Slope::Zero();
  for (std::size_t row = 0; row < 3; ++row) {
    const Slope* line = &slopes[v.index[row] * size.width];
    sum += v.weight[row] * (u.weight[0] * line[u.index[0]] + u.weight[1] * line[u.index[1]] +
                            u.weight[2] * line[u.index[2]]);
  }
  return sum;
}

}  // namespace carom
