#include "plugin/pybullet/body_shape.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace carom::plugin {
namespace {

using Form = ContactBody::Form;

constexpr double kTolerance = 3e-4;  // above the rounding of floats some metres from the origin
/// m: larger bounds are those of a plane.
constexpr double kEndless = 1e9;
/// Share of the box with its inertia that a body of unknown shape fills.
constexpr double kFilled = 0.5;

double ballVolume(double radius) {
  return 4.0 / 3.0 * std::numbers::pi * radius * radius * radius;
}

/// Returns the largest difference, as a share of the largest of what is expected.
double difference(const Vec3& found, const Vec3& expected) {
  return (found - expected).cwiseAbs().maxCoeff() / expected.maxCoeff();
}

bool agree(const Vec3& found, const Vec3& expected) {
  return difference(found, expected) <= kTolerance;
}

bool agree(double found, double expected) {
  return std::abs(found - expected) <= kTolerance * expected;
}

/// Returns half the edges, in world axes, of the box around a box.
Vec3 boundsOf(const Vec3& half, const Quat& orientation) {
  return orientation.toRotationMatrix().cwiseAbs() * half;
}

/// Returns half the edges of the solid box with that mass and inertia.
Vec3 boxOf(double mass, const Vec3& inertia) {
  return 0.5 *
         (6.0 / mass * (Vec3::Constant(inertia.sum()) - 2.0 * inertia)).cwiseMax(0.0).cwiseSqrt();
}

/// Returns half the edges of the box around the solid cylinder along z with that mass and inertia.
Vec3 cylinderOf(double mass, const Vec3& inertia) {
  const double radius = std::sqrt(2.0 * inertia.z() / mass);
  const double square = 12.0 * (inertia.x() / mass - 0.25 * radius * radius);
  return {radius, radius, 0.5 * std::sqrt(std::max(0.0, square))};
}

bool isSphere(const ShapeSigns& signs) {
  const double margin = signs.dynamics.margin;
  return margin > 0.0 && std::isfinite(margin) && agree(*signs.halfBounds, Vec3::Constant(margin));
}

BodyShape sphere(double radius) {
  return {Form::sphere, Vec3::Constant(2.0 * radius), radius, ballVolume(radius)};
}

BodyShape ofWhatMoves(const ShapeSigns& signs) {
  const b3::DynamicsInfo& dynamics = signs.dynamics;
  const Vec3 inertia{dynamics.inertia[0], dynamics.inertia[1], dynamics.inertia[2]};
  const Vec3 box = boxOf(dynamics.mass, inertia);
  const double boxVolume = 8.0 * box.prod();
  if (!std::isfinite(boxVolume)) return {};
  if (!signs.halfBounds) return {.edges = 2.0 * box, .volume = kFilled * boxVolume};
  const Vec3& bounds = *signs.halfBounds;
  const double radius = dynamics.margin;
  const double asBox = difference(bounds, boundsOf(box, signs.orientation));
  // Bullet counts the margin of a hull once more in its inertia than in its bounds.
  const Vec3 hull = box - Vec3::Constant(radius);
  const bool isHull = difference(bounds, boundsOf(hull.cwiseMax(0.0), signs.orientation)) < asBox;
  if (asBox <= kTolerance && !isHull && boxVolume > 0.0) {
    const bool isCapsule = agree(box.x(), radius) && agree(box.y(), radius) && box.z() > radius;
    if (!isCapsule) return {.form = Form::box, .edges = 2.0 * box, .volume = boxVolume};
    const double straight = 2.0 * (box.z() - radius);
    return {Form::capsule, 2.0 * box, radius,
            std::numbers::pi * radius * radius * straight + ballVolume(radius)};
  }
  const Vec3 cylinder = cylinderOf(dynamics.mass, inertia);
  if (agree(inertia.x(), inertia.y()) && agree(bounds, boundsOf(cylinder, signs.orientation)))
    return {Form::cylinder, 2.0 * cylinder, cylinder.x(),
            2.0 * std::numbers::pi * cylinder.x() * cylinder.x() * cylinder.z()};
  return {.edges = 2.0 * box, .volume = kFilled * boxVolume};
}

}  // namespace

BodyShape shapeOf(const ShapeSigns& signs) {
  if (signs.halfBounds && isSphere(signs)) return sphere(signs.dynamics.margin);
  if (signs.dynamics.mass > 0.0 && std::isfinite(signs.dynamics.mass)) return ofWhatMoves(signs);
  if (signs.halfBounds && signs.halfBounds->maxCoeff() > kEndless) return {.form = Form::plane};
  return {};
}

}  // namespace carom::plugin
