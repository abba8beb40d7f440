#include "bullet_bridge/shapes/separation_bound.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace carom::bullet {
namespace {

constexpr double kBoundRounding = 8.0 * std::numeric_limits<double>::epsilon();

// Upper bound (m/s^2) of the acceleration along n that rotation gives to the points of a piece.
double centripetal(const Vec3& angularVelocity, const Vec3& tilt, double reach) {
  return angularVelocity.norm() * tilt.norm() * reach;
}

}  // namespace

SeparationBound::SeparationBound(const Side& body, const Side& other, const Motion& relative,
                                 const Vec3& normal, double horizon)
    : body_(body.piece), other_(other.piece), normal_(normal) {
  const ConvexPiece& piece = *body_.piece;
  const ConvexPiece& against = *other_.piece;
  onHalfSpace_ = against.core() == ConvexPiece::Core::halfSpace;
  distance_ = normal.dot(relative.position) - piece.margin() - against.margin();
  rate_ = normal.dot(relative.velocity);
  rounding_ = kBoundRounding * (piece.coreReach() + std::abs(distance_));
  if (onHalfSpace_) {
    bodyTilt_ = normal.cross(body.angularVelocity - other.angularVelocity);
    otherTilt_ = Vec3::Zero();
    curvature_ =
        centripetal(body.angularVelocity, normal.cross(body.angularVelocity), piece.coreReach());
    boundHalfSpace(other.angularVelocity, relative, horizon);
    if (other.angularVelocity.norm() > 0.0) {
      curvature_ +=
          2.0 * other.angularVelocity.norm() * body.angularVelocity.norm() * piece.coreReach();
    }
  } else {
    bodyTilt_ = normal.cross(body.angularVelocity);
    otherTilt_ = normal.cross(other.angularVelocity);
    rounding_ += kBoundRounding * against.coreReach();
    curvature_ = centripetal(body.angularVelocity, bodyTilt_, piece.coreReach()) +
                 centripetal(other.angularVelocity, otherTilt_, against.coreReach());
  }
  // A bound that is not concave would not hold in between: accelerations that part the pieces are
  // left out.
  curvature_ = std::max(curvature_ - normal.dot(relative.acceleration), 0.0);
}

// Seen from the turning body, the height of a point at r over the plane has the acceleration
//
//     n.(a + omega' x (omega' x p)) - 2 n.(omega x v) - n.(omega x (omega x r)),    r = c + p,
//
// with the other's omega and, of a point p of the body, its omega' and the velocity v that the
// turning frame sees. |n x omega| is constant, as n turns with omega.
SeparationBound SeparationBound::turningWithOther(const Side& body, const Side& other,
                                                  const Motion& relative, const Vec3& normal,
                                                  double horizon) {
  const ConvexPiece& piece = *body.piece.piece;
  const ConvexPiece& against = *other.piece.piece;
  const double distance = normal.dot(relative.position) - piece.margin() - against.margin();
  SeparationBound bound(body, other, distance, normal);
  const Vec3& turning = other.angularVelocity;
  const Vec3 seen = relative.velocity - turning.cross(relative.position);
  const Vec3 spin = body.angularVelocity - turning;
  bound.rate_ = normal.dot(seen);
  bound.bodyTilt_ = normal.cross(spin);
  bound.otherTilt_ = Vec3::Zero();
  bound.rounding_ = kBoundRounding * (piece.coreReach() + std::abs(distance) + against.coreReach());
  const double tilting = normal.cross(turning).norm();
  const double acceleration = relative.acceleration.norm();
  const double fastest = relative.velocity.norm() + acceleration * horizon;
  const double farthest = relative.position.norm() + fastest * horizon;
  const double fastestSeen = seen.norm() + horizon * (acceleration + turning.norm() * fastest) +
                             spin.norm() * piece.coreReach();
  const double turned = tilting * horizon * acceleration;
  bound.curvature_ =
      std::max(turned - normal.dot(relative.acceleration), 0.0) +
      tilting * (2.0 * fastestSeen + turning.norm() * farthest) +
      spin.norm() * (body.angularVelocity.norm() + turning.norm()) * piece.coreReach();
  return bound;
}

// Seen from a turning plane, points also feel the plane's rotation: the acceleration of their
// height has a Coriolis and a centrifugal term.
void SeparationBound::boundHalfSpace(const Vec3& angularVelocity, const Motion& relative,
                                     double horizon) {
  const double turning = angularVelocity.norm();
  if (turning == 0.0) return;
  rate_ -= normal_.dot(angularVelocity.cross(relative.position));
  const double acceleration = relative.acceleration.norm();
  const double fastest = relative.velocity.norm() + acceleration * horizon;
  const double farthest = relative.position.norm() + fastest * horizon + body_.piece->coreReach();
  // The acceleration's part along n turns with it, so all of it counts.
  curvature_ += 2.0 * turning * fastest + turning * turning * farthest + 2.0 * acceleration;
}

double SeparationBound::at(double time) const {
  const Vec3 below = normal_ + time * bodyTilt_;
  double gap = distance_ + time * (rate_ - 0.5 * curvature_ * time);
  gap += below.dot(body_.support(-below));
  if (onHalfSpace_) return gap - other_.piece->planeConstant() - normal_.dot(other_.position);
  const Vec3 above = normal_ + time * otherTilt_;
  return gap - above.dot(other_.support(above));
}

double SeparationBound::gapAtOnce(double& closingSpeed) const {
  const Vec3 lowest = body_.support(-normal_);
  double gap = distance_ + normal_.dot(lowest);
  closingSpeed = -rate_ - bodyTilt_.dot(lowest);
  if (onHalfSpace_) return gap - other_.piece->planeConstant() - normal_.dot(other_.position);
  const Vec3 highest = other_.support(normal_);
  closingSpeed += otherTilt_.dot(highest);
  return gap - normal_.dot(highest);
}

bool SeparationBound::isClear(double horizon) const {
  return at(horizon) > rounding_ && at(0.0) > rounding_;
}

SeparationBound::Clear SeparationBound::clearTime(double horizon) const {
  constexpr int kChords = 4;
  double high = horizon;
  double atHigh = at(high);
  if (atHigh > 0.0) return {horizon, horizon};
  double closing = 0.0;
  const double gap = gapAtOnce(closing);
  if (!(gap > 0.0)) return {0.0, 0.0};
  // Time at which the two points that are nearest now would meet: b is zero there or, if others
  // come first, negative.
  const double root = closing + std::sqrt(closing * closing + 2.0 * curvature_ * gap);
  if (2.0 * gap < root * high) {
    high = 2.0 * gap / root;
    atHigh = at(high);
  }
  Clear clear{0.0, high};
  double atLow = gap;
  if (atHigh >= -rounding_) return {high, high};
  // A chord lies below a concave function: where it is zero, the function is not negative yet.
  for (int chord = 0; chord < kChords && atLow > 0.1 * gap; ++chord) {
    const double time = clear.until + (high - clear.until) * atLow / (atLow - atHigh);
    const double value = at(time);
    if (value < -rounding_ || !(time > clear.until)) break;
    clear.until = time;
    atLow = value;
  }
  return clear;
}

}  // namespace carom::bullet
