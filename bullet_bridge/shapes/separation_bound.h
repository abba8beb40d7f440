#pragma once

#include "bullet_bridge/geometry/rigid_motion.h"
#include "bullet_bridge/shapes/gjk.h"

namespace carom::bullet {

/// A lower bound of the gap of two moving pieces from an instant on, along a direction n that keeps
/// still or turns at a constant angular velocity w:
///
///     b(t) = min over body of n.(x + x' t) - max over other of n.(x + x' t) - margins - K t^2 / 2
///
/// with velocities x' as the turning direction sees them, and K the largest acceleration along n
/// that rotation and forces give to any point. The extremes over the points of a core are its
/// support functions in a direction tilted by the rotation, so b costs two of them. As b is
/// concave, the pieces are apart from the instant until any t at which b is not negative. [any
/// thread]
///
/// A direction that keeps still lasts long where bodies fly by each other. One that turns with a
/// body lasts where a face of that body slides or tilts on the other; one that stays perpendicular
/// to an edge of each, where edges slide along each other.
class SeparationBound {
 public:
  /// One of the two pieces, placed relative to the centre of the body that it is part of.
  struct Side {
    PlacedPiece piece;
    Vec3 angularVelocity = Vec3::Zero();
  };
  /// Two pieces and the motion of body's centre seen from other's, from the instant on. A half
  /// space must be `other`.
  struct Pieces {
    Side body, other;
    Motion relative;
  };
  /// The direction n, from other to body, at the instant, and its angular velocity (rad/s); that of
  /// a half space's own normal is always the half space's.
  struct Direction {
    Vec3 normal;
    Vec3 turning = Vec3::Zero();
  };
  SeparationBound(const Pieces& pieces, const Direction& direction, double horizon);

  /// True if the pieces are surely apart from the instant until `horizon` (s); they need not be
  /// apart at the instant.
  bool isClear(double horizon) const;

  struct Clear {
    double until = 0.0;    ///< s, the pieces are apart until then
    double latest = 0.0;   ///< s, b is not positive there, unless it is the horizon
    double nearest = 0.0;  ///< s, when the two points that are nearest now would meet
  };
  /// Expects pieces that are apart at the instant.
  Clear clearTime(double horizon) const;

 private:
  struct Value {
    double gap = 0.0;    // m
    double slope = 0.0;  // m/s
  };
  Value at(double time) const;

  PlacedPiece body_, other_;
  bool onHalfSpace_ = false;
  Vec3 normal_;
  Vec3 bodyTilt_ = Vec3::Zero(), otherTilt_ = Vec3::Zero();  // n x (omega - w), 1/s
  double distance_ = 0.0;   // m, of the centres along n, less the margins
  double rate_ = 0.0;       // m/s, of the centres along n
  double curvature_ = 0.0;  // m/s^2, the K above
  double rounding_ = 0.0;   // m
};

}  // namespace carom::bullet
