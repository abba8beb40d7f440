#pragma once

#include <complex>
#include <span>
#include <vector>

#include "carom/audio/vector.h"

namespace carom::modal {

/// A function at a point of a surface, and its derivative along a direction.
struct Slope {
  double value = 0.0;
  double slope = 0.0;
};

/// The waves j_l(k r) Y_lm at points of a surface, from which the multipoles follow of what goes
/// out from there (ModeRadiation):
///
///     c_lm = i^l integral (H d/dn + source) j_l(k r) Y_lm dS
///
/// [one thread], allocates.
class SurfaceWaves {
 public:
  /// Wave number in 1/m; orders up to `order`; points nearer to the centre than `smallest` (m, > 0)
  /// count as so far away.
  SurfaceWaves(double waveNumber, int order, double smallest);

  /// Returns the waves, by l^2 + l + m, at a point (m, from the centre), and their derivatives
  /// along the unit normal. Valid until the next call.
  std::span<const Slope> at(const Vec3& point, const Vec3& normal);

  /// Multiplies each coefficient by its i^l.
  static void turnPhases(std::span<std::complex<double>> coefficients);

 private:
  double waveNumber_;
  int order_;
  double smallest_;
  std::vector<Slope> waves_;
};

}  // namespace carom::modal
