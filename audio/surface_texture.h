#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "audio/result.h"

namespace carom {

/// Statistics of a rough surface, isotropic and Gaussian: its heights' spectrum is flat for
/// waves longer than 2 pi correlation lengths and falls as q^(-2 (1 + hurst)) for shorter ones
/// (self-affine with roll-off: Persson et al. 2005, J. Phys.: Condens. Matter 17, R1, section 2).
struct Roughness {
  double rmsHeight = 0.0;          ///< m, >= 0; 0: smooth
  double correlationLength = 0.0;  ///< m, > 0
  double hurst = 0.8;              ///< 1, above 0, at most 1

  bool operator==(const Roughness&) const = default;
};

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
  static Result<SurfaceTexture> ofSlopes(Size size, const Eigen::Vector2d& texel,
                                         std::vector<Slope> slopes);

  /// A surface of that roughness, the same one for each seed: 512 x 512 texels of an eighth of the
  /// correlation length. Its slopes are those of waves as short as two texels. Errors: values
  /// outside of Roughness's ranges.
  static Result<SurfaceTexture> rough(const Roughness& roughness, std::uint64_t seed);

  const Eigen::Vector2d& texel() const { return texel_; }  ///< m, along u and v
  Size size() const { return size_; }

  /// The slopes at a point (m), as a look of that width (m) sees them: waves shorter than about
  /// twice the width are averaged out. Interpolated, between texels and between copies.
  Eigen::Vector2d slope(const Eigen::Vector2d& at, double width) const;

  /// 1, root of the mean square of the slope along a line, in a look of that width.
  double rmsSlope(double width) const;

 private:
  struct Level {
    Size size;
    Eigen::Vector2d perMetre = Eigen::Vector2d::Zero();  // texels
    double rms = 0.0;                                    // of the slope along a line
    std::vector<Slope> slopes;
  };
  SurfaceTexture() = default;
  void addLevels();
  Eigen::Vector2d sample(const Level& level, const Eigen::Vector2d& at) const;

  Size size_;
  Eigen::Vector2d texel_ = Eigen::Vector2d::Zero();
  double width_ = 0.0;         // m, of a look that sees single texels
  std::vector<Level> levels_;  // the finest first; each half of the one before
};

}  // namespace carom
