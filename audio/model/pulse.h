#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "carom/audio/synth_settings.h"

namespace carom::audio {

/// One node of a quadrature rule: the sum of weight * g(u) approximates the integral of force(u)
/// g(u) du.
struct PulseNode {
  double u = 0.0;       ///< contact durations since first touch
  double weight = 0.0;  ///< share of the impulse, dimensionless
};

/// The leading power of the time since an edge with which a force begins there, beside its smooth
/// part.
enum class EdgeKind : std::uint8_t {
  corner,    ///< power 1
  root,      ///< power 3/2
  parabola,  ///< power 2
  cubic,     ///< power 3
};

/// An edge: near u, the force is a smooth function plus coefficient * |u - edge.u|^kind on one
/// side.
struct PulseEdge {
  double u = 0.0;
  EdgeKind kind = EdgeKind::root;
  double coefficient = 0.0;
  bool opens = true;  ///< true: on the later side
};

/// The force at evenly spaced u, for loops in which time counts: right to 1e-6 of its peak, and to
/// 1e-7 away from the ends. Linear in each cell: value + rise * (share of the cell that has
/// passed).
struct ForceTable {
  struct Cell {
    float value = 0.0F;
    float rise = 0.0F;
  };
  double begin = 0.0;  ///< u of the first cell's begin
  double scale = 0.0;  ///< cells per u
  std::span<const Cell> cells;
};

/// The shape in time of a contact force, as an immutable object. All of it: [any thread].
///
///     u = (t - t0) / tau
///     a(t) = |j| / (m tau) * force(u)
///     da/dt = |j| / (m tau^2) * slope(u)
///
/// with the impulse j (N s), the mass m (kg) and the contact duration tau (s). The integral of
/// force(u) is impulse(): 1, but for the hand-out's pulse.
///
/// Shapes, with their L2 error of force and of slope against `hertz` of the same duration:
/// - `hertz`: the solution of m d'' = -K d^(3/2) (Johnson 1985, section 11.4). Tabulated: the force
///   is right to 1e-12 of its peak, the slope to 1e-11. The slope starts as the square root of
///   time: it is finite everywhere, its own derivative is not.
/// - `halfSine`: 14.0 %, 38.8 %. Its slope jumps at both ends.
/// - `gaussian`: 8.4 %, 23.3 %. It begins before the contact and ends after it.
/// - `mitchellNetravali`: 69.3 %, 206.7 %. Chadwick, Zheng and James (2012) use a cubic of
///   this family; its width for a contact is our choice. Its support
///   [-2, 2] becomes the contact's [0, 1], which is narrow: with half the contact's duration as its
///   unit it would err by 8.0 % and 22.3 %. It is negative in the outer 3/14 at
///   either end, by at most 2/49 of its peak: no contact pulls, so use it for comparisons.
/// - `courseGaussian`: 22.7 %, 43.2 %. Its bits are those of pi/2 times gaussianPulse() and
///   gaussianPulseSlope().
/// Both Gaussians are cut where they are 5e-17 of their peak.
class Pulse {
 public:
  /// The pulse of a shape: built at first use, lives as long as the program.
  static const Pulse& of(PulseShape shape);

  /// The force of a contact that loses energy, for a coefficient of restitution e in (0, 1]; values
  /// below kLowestRestitution count as that. The contact law is that of Hunt and Crossley (1975,
  /// J. Appl. Mech. 42, 440-445) on Hertz' spring:
  ///
  ///     m d'' = -K d^(3/2) (1 + chi d')
  ///
  /// It dissipates, never pulls, and ends at d = 0. With v = d', v dv / (1 + chi v) =
  /// -(K/m) d^(3/2) dd; its left side integrated from the approach speed v0 to -e v0 is zero, as d
  /// is 0 at both. So e decides x = chi v0 alone: x (1 + e) = ln((1 + x) / (1 - e x)).
  ///
  /// The force is skewed: steeper before its peak than after. u counts this contact's own duration,
  /// which is dissipativeDuration() times the elastic one. Equals `hertz` at e = 1. The force is
  /// right to 1e-11 of its peak, the slope to 1e-10, and to 5e-9 where e is below 0.1. Losses
  /// outside of the contact (vibration, plastic flow) are not modelled. Takes about half a
  /// millisecond; its rules are made when they are asked for.
  static Pulse dissipativeHertz(double restitution);

  double begin() const;  ///< contact durations, where the force begins: 0; earlier for Gaussians
  double end() const;    ///< contact durations, where the force ends: 1; later for Gaussians

  double force(double u) const;  ///< dimensionless, 0 outside of [begin, end]
  double slope(double u) const;  ///< d force / du, dimensionless, 0 outside of [begin, end]

  double impulse() const;    ///< integral of force
  double centre() const;     ///< contact durations, mean of u weighted by force
  double peakForce() const;  ///< largest magnitude of force
  double peakSlope() const;  ///< largest magnitude of slope

  /// The points where the force is not smooth: its ends, and where its pieces meet. A Gaussian has
  /// none.
  std::span<const PulseEdge> edges() const;
  /// The force as a table. Made once, at first use, which may allocate and lock, as for `rule`.
  ForceTable forceTable() const;

  /// Number of nodes behind the last one of a rule that may be read, for loops over whole vectors
  /// of them.
  static constexpr std::size_t kRulePadding = 7;
  /// Gauss quadrature with the force as the weight function: `count` nodes within (begin, end),
  /// ascending, their weights positive and of sum impulse(), exact for polynomials up to degree
  /// 2 count - 1. `count` is one of ruleCounts(). Made once, at first use, which takes the longer
  /// the larger it is, and may allocate and lock: ask for it before an audio thread does. The
  /// span lives as long as any copy of this pulse.
  ///
  /// The `mitchellNetravali` pulse is no weight of one sign. Its rules of more than two nodes are
  /// three Gauss rules, one each for the middle and for the parts that pull, whose weights are
  /// negative; they are exact up to the degree that the smallest of the three allows, at least 1.
  std::span<const PulseNode> rule(std::size_t count) const;

  /// The numbers of nodes for which there are rules, ascending, from 2 to 128.
  static std::span<const std::size_t> ruleCounts();

  /// The smallest rule whose transform, the sum of weight * exp(i w u), is that of the pulse for
  /// every |w| <= bandwidth (rad per contact duration) within ruleTolerance(bandwidth); 0 where no
  /// rule is good enough.
  std::size_t ruleSize(double bandwidth) const;

 private:
  struct Model;
  explicit Pulse(std::shared_ptr<const Model> model);

  std::shared_ptr<const Model> model_;
};

/// Lowest restitution that is distinguished; one below it counts as this: the contact then sticks
/// rather than bounces.
inline constexpr double kLowestRestitution = 0.05;

/// The error that ruleSize() admits: 1e-7 * min(1, 30 / bandwidth)^1.5. The spectrum of the elastic
/// contact falls as the power 2.5 of frequency, from where it is 0.005: the error is 2e-5 of it at
/// 30 rad per contact duration, 3e-4 at 430. [any thread]
double ruleTolerance(double bandwidth);

/// The loss chi v0 of a contact of the given restitution: 0 at restitution 1, and the greater the
/// less it is. See Pulse::dissipativeHertz(). [any thread]
double dissipativeLoss(double restitution);

/// Duration of a contact of the given restitution, as a multiple of the elastic one's at the same
/// approach speed: >= 1, and 1 at restitution 1. See Pulse::dissipativeHertz(). [any thread]
double dissipativeDuration(double restitution);

}  // namespace carom::audio
