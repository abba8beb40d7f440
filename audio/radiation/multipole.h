#pragma once

#include <array>
#include <complex>
#include <span>

#include "audio/model/spherical_harmonics.h"
#include "carom/audio/modal_model.h"
#include "carom/audio/vector.h"

namespace carom::audio {

/// The highest order of multipoles that can be evaluated; terms above it are left out.
inline constexpr int kHighestMultipole = 16;

/// The spherical harmonics of one direction, for all the modes that are heard from there.
class DirectionHarmonics {
 public:
  /// `direction` points from the centre of mass to the listener, model frame, of any length but 0
  /// (which is taken for z); harmonics up to `order`, at most kHighestMultipole. [any thread;
  /// does not allocate]
  explicit DirectionHarmonics(const Vec3& direction, int order = kHighestMultipole);

  int order() const { return order_; }
  std::span<const double> values() const { return std::span(values_).first(harmonicCount(order_)); }

 private:
  int order_;
  std::array<double, harmonicCount(kHighestMultipole)> values_;  // not set above order_
};

/// R_l of ModeRadiation's definition, one order after the other from 0 on: R_l+1 = R_l-1 - i (2 l +
/// 1) / (k r) R_l, upwards, which is stable for the function that grows. [any thread]
class RadialFunctions {
 public:
  /// Requires k r > 0.
  explicit RadialFunctions(double kr) : step_(1.0 / kr), factor_(step_) {}

  std::complex<double> value() const { return value_; }

  void next() {
    const std::complex<double> next(below_.real() + factor_ * value_.imag(),
                                    below_.imag() - factor_ * value_.real());
    below_ = value_;
    value_ = next;
    factor_ += 2.0 * step_;
  }

 private:
  double step_;
  double factor_;  // (2 l + 1) / (k r)
  std::complex<double> value_ = 1.0;
  std::complex<double> below_ = 1.0;  // R_-1 is R_0
};

/// The order of the multipoles that a mode has; -1 if it has none.
int multipoleOrder(const ModeRadiation& radiation);

/// sqrt(kg) / m^2, the steady response of ModeRadiation's definition, H = p / (-w^2 Q), at the
/// distance r (m, > 0) from the centre of mass, less the factor exp(-i k r), which is the delay:
///
///     sum_lm  c_lm R_l(k r) Y_lm(d) / r
///
/// so p(t) = Re(H q''(t - r / c)) of a slowly decaying oscillation q'' = -w^2 Q exp(i w t). Terms
/// above the order of `direction` are left out. Wave number k = w / c, 1/m, > 0, the mode's own
/// in the model's medium.
///
/// Nearer than the enclosing sphere (enclosingRadius) the series need not converge, and near the
/// centre it grows without bound: take the distance as at least that radius. [any thread; does not
/// allocate]
std::complex<double> multipoleTransfer(const ModeRadiation& radiation,
                                       const DirectionHarmonics& direction, double waveNumber,
                                       double distance);

/// The transfer of a mode as a pulsating point, in the unit of multipoleTransfer:
/// rho0 volume / (4 pi r). True for waves long against the body unless the volume is small, as that
/// of bending is. [any thread]
double monopoleTransfer(const ModeRadiation& radiation, double density, double distance);

/// sqrt(kg) / m: distance times |H| far away, root mean square over all directions. The sound
/// power, which a room receives, is 4 pi / (2 rho0 c) times the square of w^2 |Q| times this value.
/// [any thread]
double meanTransfer(const ModeRadiation& radiation);

/// Radius in m of the smallest sphere about `centre` that holds the surface. [any thread]
double enclosingRadius(const SurfaceMesh& surface, const Vec3& centre);

}  // namespace carom::audio
