#include "bullet_bridge/shapes/separation_bound.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace carom::bullet {
namespace {

constexpr double kBoundRounding = 8.0 * std::numeric_limits<double>::epsilon();

// How a direction turns within the horizon.
struct Turning {
  Vec3 velocity;         // rad/s
  double tilting = 0.0;  // 1/s, |n'|, which is constant
  double tilted = 0.0;   // how far n may come from where it is now
};

// Upper bound (m/s^2) of the acceleration along n that a body's rotation gives to the points of a
// piece, as far as its centre from the body's at `reach`. With the body's angular velocity
// omega = w + spin, a point at p feels
//
//     n.(omega x (omega x p)) - 2 n.(w x (omega x p)) + n.(w x (w x p))
//         = n.((spin x w) x p) + n.(spin x (spin x p)).
double accelerationOfPoints(const Vec3& spin, const Vec3& tilt, const Turning& turning,
                            double reach) {
  const double spinning = spin.norm();
  const double tilting = std::min(spinning, tilt.norm() + turning.tilted * spinning);
  return reach * (spin.cross(turning.velocity).norm() + spinning * tilting);
}

// The same of the centres, towards each other: of n.c, with n turning and c the path of one centre
// seen from the other,
//
//     n.c'' - 2 n.(w x c') + n.(w x (w x c)).
double accelerationOfCentres(const Motion& relative, const Vec3& normal, const Turning& turning,
                             double horizon) {
  const double acceleration = relative.acceleration.norm();
  const double forces = turning.tilted * acceleration - normal.dot(relative.acceleration);
  if (turning.tilting == 0.0) return std::max(forces, 0.0);
  const double fastest = relative.velocity.norm() + acceleration * horizon;
  const double farthest = relative.position.norm() + fastest * horizon;
  const double across =
      std::abs(normal.cross(turning.velocity).dot(relative.velocity)) +
      turning.tilting * horizon * (acceleration + turning.velocity.norm() * fastest);
  return std::max(forces, 0.0) + 2.0 * across +
         turning.tilting * turning.velocity.norm() * farthest;
}

}  // namespace

SeparationBound::SeparationBound(const Pieces& pieces, const Direction& direction, double horizon)
    : body_(pieces.body.piece), other_(pieces.other.piece), normal_(direction.normal) {
  const ConvexPiece& piece = *body_.piece;
  const ConvexPiece& against = *other_.piece;
  const Motion& relative = pieces.relative;
  onHalfSpace_ = against.core() == ConvexPiece::Core::halfSpace;
  Turning turning{onHalfSpace_ ? pieces.other.angularVelocity : direction.turning};
  const Vec3 turned = turning.velocity.cross(normal_);
  turning.tilting = turned.norm();
  turning.tilted = std::min(2.0, turning.tilting * horizon);
  const double reach = piece.coreReach();
  distance_ = normal_.dot(relative.position) - piece.margin() - against.margin();
  rounding_ = kBoundRounding * (reach + std::abs(distance_) + against.coreReach());
  rate_ = normal_.dot(relative.velocity) + turned.dot(relative.position);
  const Vec3 spin = pieces.body.angularVelocity - turning.velocity;
  bodyTilt_ = normal_.cross(spin);
  // A bound that is not concave would not hold in between: accelerations that part the pieces are
  // left out.
  curvature_ = accelerationOfCentres(relative, normal_, turning, horizon) +
               accelerationOfPoints(spin, bodyTilt_, turning, reach);
  if (onHalfSpace_) return;
  const Vec3 otherSpin = pieces.other.angularVelocity - turning.velocity;
  otherTilt_ = normal_.cross(otherSpin);
  curvature_ += accelerationOfPoints(otherSpin, otherTilt_, turning, against.coreReach());
}

SeparationBound::Value SeparationBound::at(double time) const {
  const Vec3 below = normal_ + time * bodyTilt_;
  const Vec3 lowest = body_.support(-below);
  Value value{distance_ + time * (rate_ - 0.5 * curvature_ * time) + below.dot(lowest),
              rate_ - curvature_ * time + bodyTilt_.dot(lowest)};
  if (onHalfSpace_) {
    value.gap -= other_.piece->planeConstant() + normal_.dot(other_.position);
    return value;
  }
  const Vec3 above = normal_ + time * otherTilt_;
  const Vec3 highest = other_.support(above);
  value.gap -= above.dot(highest);
  value.slope -= otherTilt_.dot(highest);
  return value;
}

bool SeparationBound::isClear(double horizon) const {
  return at(horizon).gap > rounding_ && at(0.0).gap > rounding_;
}

// The zero of b is closed in from both sides: a chord of a concave function lies below it, so that
// b is not negative yet where the chord is zero; a tangent lies above it, so that b is not positive
// any more where the tangent at a later time is zero.
SeparationBound::Clear SeparationBound::clearTime(double horizon) const {
  constexpr int kRounds = 8;
  constexpr double kCloseEnough = 0.9;  // of the time until b is zero
  const Value end = at(horizon);
  if (end.gap > 0.0) return {horizon, horizon, horizon};
  Value low = at(0.0);
  if (!(low.gap > 0.0)) return {};
  Value high = end;
  Clear clear{0.0, horizon, low.slope < 0.0 ? -low.gap / low.slope : horizon};
  const auto narrow = [&](double time) {
    const Value value = at(time);
    if (value.gap >= -rounding_) {
      clear.until = time;
      low = value;
    }
    if (value.gap <= rounding_) {
      clear.latest = time;
      high = value;
    }
  };
  // The two points that are nearest now would meet under the greatest acceleration: b is zero there
  // or, if other points come first, negative.
  const double root = std::sqrt(low.slope * low.slope + 2.0 * curvature_ * low.gap) - low.slope;
  if (2.0 * low.gap < root * horizon) narrow(2.0 * low.gap / root);
  for (int round = 0; round < kRounds && clear.until < kCloseEnough * clear.latest; ++round) {
    const double tangent = clear.latest - high.gap / high.slope;
    const double chord =
        clear.until + (clear.latest - clear.until) * low.gap / (low.gap - high.gap);
    const double time = round % 2 == 0 ? tangent : chord;
    if (!(time > clear.until && time < clear.latest)) break;
    narrow(time);
  }
  return clear;
}

}  // namespace carom::bullet
