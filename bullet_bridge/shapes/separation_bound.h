#pragma once

#include "bullet_bridge/geometry/rigid_motion.h"
#include "bullet_bridge/shapes/gjk.h"

namespace carom::bullet {

/// A lower bound of the gap of two moving pieces from an instant on, along a direction n that keeps
/// still:
///
///     b(t) = min over body of n.(x + x' t) - max over other of n.(x + x' t) - margins - K t^2 / 2
///
/// with K the largest acceleration along n that rotation and forces give to any point. The extremes
/// over the points of a core are its support functions in a direction tilted by the rotation, so b
/// costs two of them. As b is concave, the pieces are apart from the instant until any t at which b
/// is not negative. [any thread]
class SeparationBound {
 public:
  /// One of the two pieces, placed relative to the centre of the body that it is part of.
  struct Side {
    PlacedPiece piece;
    Vec3 angularVelocity = Vec3::Zero();
  };
  /// `relative` is the motion of body's centre seen from other's, from the instant on. A half space
  /// must be `other`; where it turns, b is along its turning normal.
  SeparationBound(const Side& body, const Side& other, const Motion& relative, const Vec3& normal,
                  double horizon);
  /// Makes a bound of two pieces with a core along the direction n that turns with `other`: it
  /// lasts where a face of other slides or tilts on body, which no direction that keeps still does.
  static SeparationBound turningWithOther(const Side& body, const Side& other,
                                          const Motion& relative, const Vec3& normal,
                                          double horizon);

  /// True if the pieces are surely apart from the instant until `horizon` (s); they need not be
  /// apart at the instant.
  bool isClear(double horizon) const;

  struct Clear {
    double until = 0.0;      ///< s, the pieces are apart until then
    double estimated = 0.0;  ///< s, an impact is to be expected no later than this
  };
  /// Expects pieces that are apart at the instant.
  Clear clearTime(double horizon) const;

 private:
  SeparationBound(const Side& body, const Side& other, double distance, const Vec3& normal)
      : body_(body.piece), other_(other.piece), normal_(normal), distance_(distance) {}
  double at(double time) const;
  double gapAtOnce(double& closingSpeed) const;
  void boundHalfSpace(const Vec3& angularVelocity, const Motion& relative, double horizon);

  PlacedPiece body_, other_;
  bool onHalfSpace_ = false;
  Vec3 normal_;
  Vec3 bodyTilt_, otherTilt_;  // n x omega, 1/s
  double distance_ = 0.0;      // m, of the centres along n, less the margins
  double rate_ = 0.0;          // m/s, of the centres along n
  double curvature_ = 0.0;     // m/s^2, the K above
  double rounding_ = 0.0;      // m
};

}  // namespace carom::bullet
