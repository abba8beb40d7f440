#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <carom/audio/material.h>
#include <carom/audio/result.h>
#include <carom/audio/vector.h>

namespace carom {

/// The bumps of a surface as slopes of its height over a plane, on square texels that repeat
/// without end in both directions; with coarser copies, so that any smoothing is one look.
/// Immutable, to be shared. [any thread]
class SurfaceTexture {
 public:
  using Slope = Eigen::Vector2f;  ///< 1: dh/du, dh/dv

  /// How many texels there are along u and v: each a power of two, up to kMostTexels.
  struct Size {
    std::size_t width = 0;
    std::size_t height = 0;
  };
  static constexpr std::size_t kMostTexels = 8192;
  /// 1: steeper slopes count as that (84 degrees).
  static constexpr float kSteepest = 10.0F;

  /// Of slopes at the middles of texels, row by row from v = 0 on; `texel` in m, > 0, along u and
  /// v. The mean slope is taken away: a surface that repeats climbs nowhere. Errors: sizes, texel,
  /// a slope that is no number.
  static Result<SurfaceTexture> ofSlopes(Size size, const Vec2& texel, std::vector<Slope> slopes);

  /// A surface of that roughness, the same one for each seed: 512 x 512 texels of an eighth of the
  /// correlation length. Its slopes are those of waves as short as two texels. Textures of one
  /// Hurst exponent and seed share their memory, however rough. Errors: as whyNot(Roughness).
  static Result<SurfaceTexture> rough(const Roughness& roughness, std::uint64_t seed);

  Vec2 texel() const { return scale_ * texels_->texel; }  ///< m, along u and v
  Size size() const { return texels_->levels.front().size; }

 private:
  struct Level {
    Size size;
    Vec2 perMetre = Vec2::Zero();  // texels
    double curvature = 0.0;        // 1/m, root of its mean square
    double lost = 0.0;  // m, rms height of the waves that finer levels have and this has not
    std::vector<Slope> slopes;

    Vec2 at(const Vec2& place) const;
  };
  /// Of what may be scaled to many textures.
  struct Texels {
    Vec2 texel = Vec2::Zero();
    double width = 0.0;         // m, of a look that sees single texels
    double steepest = 0.0;      // along any line
    std::vector<Level> levels;  // the finest first; each half of the one before
  };

 public:
  /// A look of some width at the texture, for many places. Lives as long as it.
  struct Look {
    const Level* fine = nullptr;
    const Level* coarse = nullptr;  ///< null: `fine` alone
    double share = 0.0;             ///< of `coarse`
  };
  /// `width` in m: waves shorter than about twice the width are averaged out.
  Look look(double width) const;

  /// m, of the finest look at which the bumps are in the mean (of squares) no more curved than that
  /// (1/m).
  double widthOf(double curvature) const;

  /// m, of a texel of the finer of the two.
  double widthOf(const Look& look) const;

  /// m, rms height of the bumps that a look of that width (m) averages out.
  double heightBelow(double width) const;

  /// The slopes at a point (m). Interpolated, between texels and between copies.
  Vec2 slope(const Look& look, const Vec2& at) const;
  Vec2 slope(const Vec2& at, double width) const { return slope(look(width), at); }

  /// 1, of any look along any line.
  double steepest() const { return steepness_ * texels_->steepest; }

 private:
  SurfaceTexture() = default;
  static std::shared_ptr<const Texels> roughTexels(double hurst, std::uint64_t seed);
  static std::shared_ptr<const Texels> makeRoughTexels(double hurst, std::uint64_t seed);
  static void addLevels(Texels& texels);
  static void measure(Texels& texels);
  static double curvatureOf(const Level& level);

  std::shared_ptr<const Texels> texels_;
  double scale_ = 1.0;         // of lengths
  double steepness_ = 1.0;     // of slopes
  Vec2 axis_ = Vec2::UnitX();  // of the texels, unit
};

/// Why it cannot be used: one sentence, or nothing when it can be. [any thread]
std::string whyNot(const Roughness& roughness);

}  // namespace carom
