#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <carom/audio/material.h>
#include <carom/audio/result.h>
#include <carom/audio/vector.h>

namespace carom {

namespace audio {
struct TextureRecord;
}

/// The bumps of a surface as slopes of its height over a plane, on a grid of texels that repeats
/// without end in both directions; with coarser copies, so that smoothing to any width takes one
/// lookup. Immutable, to be shared. [any thread]
class SurfaceTexture {
 public:
  using Slope = Eigen::Vector2f;  ///< 1: dh/du, dh/dv

  /// Number of texels along u and v: each a power of two, up to kMostTexels.
  struct Size {
    std::size_t width = 0;
    std::size_t height = 0;
  };
  static constexpr std::size_t kMostTexels = 8192;
  /// Largest slope along u or v (84 degrees); steeper ones are limited to it.
  static constexpr float kSteepest = 10.0F;

  /// Makes a texture from slopes at the middles of texels, row by row from v = 0 on; `texel` is the
  /// size of a texel in m, 1e-12 to 1e6, along u and v. The mean slope is subtracted: a surface
  /// that repeats has none. Errors: sizes, texel, a number of slopes other than that of texels, a
  /// slope that is no number.
  static Result<SurfaceTexture> ofSlopes(Size size, const Vec2& texel, std::vector<Slope> slopes);

  /// Makes a random surface of that roughness, the same one for each seed: 512 x 512 texels of an
  /// eighth of the correlation length. Its slopes include waves as short as two texels. Textures of
  /// one Hurst exponent and seed share their memory, however rough. Errors: as validate(Roughness).
  static Result<SurfaceTexture> rough(const Roughness& roughness, std::uint64_t seed);

  Vec2 texel() const { return scale_ * texels_->texel; }  ///< m, along u and v
  Size size() const { return texels_->levels.front().size; }

 private:
  struct Level {
    Size size;
    Vec2 perMetre = Vec2::Zero();  // texels per m
    double curvature = 0.0;        // 1/m, root of its mean square
    double lost = 0.0;  // m, rms height of the waves that finer levels have and this one lacks
    std::vector<Slope> slopes;
    /// Mean squares of the slopes along a line, in third octaves of waves: the first around waves
    /// of 10^(kShortest / 10) texels, each other around longer ones.
    static constexpr std::size_t kBands = 44;
    static constexpr double kShortest = -2.0;
    std::array<float, kBands> spectrum{};

    double around(double place) const;
    static std::array<double, kBands + 1> edges(double stretch);
    Slope atTexels(const Vec2& place) const;
  };
  /// Levels of slopes that several textures may share, each with its own scale.
  struct Texels {
    Vec2 texel = Vec2::Zero();
    double width = 0.0;         // m, geometric mean of the sides of a texel
    double steepest = 0.0;      // largest slope along any line
    std::vector<Level> levels;  // the finest first; each half of the one before
  };

 public:
  /// A view of the texture smoothed to some width, for lookups at many places. Valid as long as the
  /// texture.
  struct Look {
    const Level* fine = nullptr;
    const Level* coarse = nullptr;  ///< null: `fine` alone
    double share = 0.0;             ///< weight of `coarse`, 0 to 1
  };
  /// Returns the look of that width (m): waves shorter than about twice the width are averaged out.
  Look look(double width) const;

  /// Width in m of the finest look at which the rms curvature of the bumps is at most `curvature`
  /// (1/m).
  double widthOf(double curvature) const;

  /// Width in m of a texel of the look's finer level.
  double widthOf(const Look& look) const;

  /// Rms height in m of the bumps that a look of that width (m) averages out.
  double heightBelow(double width) const;

  /// Adds the mean squares of the slopes along a line that a look shows, times a factor, by third
  /// octaves of waves: the first around the length `longest` (m), each other around shorter ones.
  /// On average over lines.
  void addSlopes(const Look& look, double longest, double factor, std::span<double> powers) const;

  /// A straight line over a look, for lookups at many places of it. Valid as long as the texture.
  class Line {
   public:
    /// The slope at a share of the line's length after its begin, times the line's `climb`.
    double at(double share) const;

   private:
    friend class SurfaceTexture;
    struct OnLevel {
      const Level* level = nullptr;  // null: none
      Vec2 begin = Vec2::Zero();     // texels
      Vec2 along = Vec2::Zero();     // texels
      Slope climb = Slope::Zero();   // along the axes of the texels
    };
    OnLevel fine_, coarse_;
  };
  /// Returns the line over a look from a point (m) on, by `along` (m); `climb` is what slopes are
  /// multiplied by: the way over the surface, in any unit.
  Line line(const Look& look, const Vec2& from, const Vec2& along, const Vec2& climb) const;

  /// Slopes along u and v at a point (m), interpolated between texels and between levels.
  Vec2 slope(const Look& look, const Vec2& at) const;
  Vec2 slope(const Vec2& at, double width) const { return slope(look(width), at); }

  /// Upper bound of the slope of any look along any line.
  double steepest() const { return steepness_ * texels_->steepest; }

 private:
  friend struct audio::TextureRecord;  // takes a texture apart for a file, and puts it together
  SurfaceTexture() = default;
  /// Refuses what ofSlopes refuses.
  static Status check(Size size, const Vec2& texel, std::span<const Slope> slopes);
  /// Makes a texture from slopes that pass `check`, without a mean.
  static SurfaceTexture ofCentred(Size size, const Vec2& texel, std::vector<Slope> slopes);
  Vec2 turned(const Vec2& v) const;
  static std::shared_ptr<const Texels> roughTexels(double hurst, std::uint64_t seed);
  static std::shared_ptr<const Texels> makeRoughTexels(double hurst, std::uint64_t seed);
  static void addLevels(Texels& texels);
  static void measure(Texels& texels);
  static void measureSpectrum(Level& level, double width);
  static double curvatureOf(const Level& level);

  std::shared_ptr<const Texels> texels_;
  double scale_ = 1.0;         // factor on lengths
  double steepness_ = 1.0;     // factor on slopes
  Vec2 axis_ = Vec2::UnitX();  // u axis of the texels, unit
};

/// Refuses a roughness with values out of range. [any thread]
Status validate(const Roughness& roughness);

}  // namespace carom
