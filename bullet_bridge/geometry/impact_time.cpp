#include "bullet_bridge/geometry/impact_time.h"

#include <cmath>

namespace carom::bullet {
namespace {

double within(double time, double horizon) {
  return time <= horizon ? time : kNever;
}

// First root of c + 2 b t + a t^2 = 0 for c > 0, without cancellation.
double firstRoot(double a, double b, double c) {
  const double discriminant = b * b - a * c;
  if (discriminant < 0.0) return kNever;
  const double root = std::sqrt(discriminant);
  if (b < 0.0) return c / (root - b);  // approaching: the nearer root, whatever the sign of a
  return a < 0.0 ? -(b + root) / a : kNever;  // leaving, but turned around
}

double gapSquared(const Motion& relative, double distance, double s) {
  return relative.positionAt(s).squaredNorm() - distance * distance;
}

// The gap is a quartic here. Steps are short against its features, so its first sign change is
// looked for on a grid, then bisected to the last bit.
double bracketedImpact(const Motion& relative, double distance, double horizon) {
  constexpr int kPieces = 32;
  double low = 0.0;
  for (int piece = 1; piece <= kPieces; ++piece) {
    double high = horizon * piece / kPieces;
    if (gapSquared(relative, distance, high) > 0.0) {
      low = high;
      continue;
    }
    for (double middle = 0.5 * (low + high); low < middle && middle < high;
         middle = 0.5 * (low + high)) {
      (gapSquared(relative, distance, middle) > 0.0 ? low : high) = middle;
    }
    return high;
  }
  return kNever;
}

}  // namespace

double sphereImpactTime(const Motion& relative, double distance, double horizon) {
  const double c = gapSquared(relative, distance, 0.0);
  const double b = relative.position.dot(relative.velocity);
  if (c <= 0.0) return b < 0.0 ? 0.0 : kNever;
  const double farthest =
      horizon * (relative.velocity.norm() + 0.5 * horizon * relative.acceleration.norm());
  if (relative.position.norm() - distance > farthest) return kNever;
  if (!relative.acceleration.isZero(0.0)) return bracketedImpact(relative, distance, horizon);
  if (b >= 0.0) return kNever;
  return within(firstRoot(relative.velocity.squaredNorm(), b, c), horizon);
}

double planeImpactTime(double height, double rate, double acceleration, double horizon) {
  if (height <= 0.0) return rate < 0.0 ? 0.0 : kNever;
  return within(firstRoot(acceleration, rate, 2.0 * height), horizon);
}

}  // namespace carom::bullet
