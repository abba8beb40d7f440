#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "bullet_bridge/geometry/rigid_motion.h"

// Slow and obvious distances between convex sets, as the oracle for the fast ones.
namespace carom::by_hand {

inline Vec3 nearestOnSegment(const Vec3& a, const Vec3& b, const Vec3& from) {
  const Vec3 edge = b - a;
  const double length = edge.squaredNorm();
  if (length == 0.0) return a;
  return a + std::clamp(edge.dot(from - a) / length, 0.0, 1.0) * edge;
}

inline double segmentSegment(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  double least =
      std::min({(nearestOnSegment(c, d, a) - a).norm(), (nearestOnSegment(c, d, b) - b).norm(),
                (nearestOnSegment(a, b, c) - c).norm(), (nearestOnSegment(a, b, d) - d).norm()});
  // If both nearest points are inside their segments, the connection is perpendicular to both
  // lines.
  const Vec3 u = b - a, v = d - c, w = c - a;
  const Vec3 normal = u.cross(v);
  const double squared = normal.squaredNorm();
  if (squared > 1e-24 * u.squaredNorm() * v.squaredNorm()) {
    const double s = w.cross(v).dot(normal) / squared;
    const double t = w.cross(u).dot(normal) / squared;
    if (s >= 0.0 && s <= 1.0 && t >= 0.0 && t <= 1.0) {
      least = std::min(least, std::abs(w.dot(normal)) / std::sqrt(squared));
    }
  }
  return least;
}

inline double pointTriangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 normal = (b - a).cross(c - a);
  const auto inside = [&](const Vec3& from, const Vec3& to) {
    return normal.dot((to - from).cross(p - from)) >= 0.0;
  };
  if (normal.squaredNorm() > 0.0 && inside(a, b) && inside(b, c) && inside(c, a)) {
    return std::abs(normal.dot(p - a)) / normal.norm();
  }
  return std::min({(nearestOnSegment(a, b, p) - p).norm(), (nearestOnSegment(b, c, p) - p).norm(),
                   (nearestOnSegment(c, a, p) - p).norm()});
}

using Points = std::vector<Vec3>;

/// Distance of the hulls of points, which must not overlap: the least over every triangle and every
/// segment of their corners. Segments and triangles inside a hull do no harm.
inline double hullHull(const Points& one, const Points& two) {
  double least = std::numeric_limits<double>::infinity();
  const auto pointsAndTriangles = [&](const Points& points, const Points& hull) {
    for (std::size_t i = 0; i < hull.size(); ++i) {
      for (const Vec3& p : points)
        least = std::min(least, (p - hull[i]).norm());
      for (std::size_t j = 0; j < i; ++j)
        for (std::size_t k = 0; k < j; ++k)
          for (const Vec3& p : points)
            least = std::min(least, pointTriangle(p, hull[i], hull[j], hull[k]));
    }
  };
  pointsAndTriangles(one, two);
  pointsAndTriangles(two, one);
  for (std::size_t i = 0; i < one.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      for (std::size_t k = 0; k < two.size(); ++k)
        for (std::size_t l = 0; l < k; ++l)
          least = std::min(least, segmentSegment(one[i], one[j], two[k], two[l]));
  return least;
}

/// Distance of two hulls with a test for overlap, which hullHull lacks: if they are apart, there is
/// a plane between them that holds a face of one or an edge of each. Returns a number that is not
/// positive if they overlap.
inline double hullHullOrOverlap(const Points& one, const Points& two) {
  double best = -std::numeric_limits<double>::infinity();
  const auto separation = [&](const Vec3& way) {
    if (way.squaredNorm() < 1e-30) return;
    const Vec3 n = way.normalized();
    double low1 = 1e300, high1 = -1e300, low2 = 1e300, high2 = -1e300;
    for (const Vec3& p : one) {
      low1 = std::min(low1, n.dot(p));
      high1 = std::max(high1, n.dot(p));
    }
    for (const Vec3& p : two) {
      low2 = std::min(low2, n.dot(p));
      high2 = std::max(high2, n.dot(p));
    }
    best = std::max({best, low1 - high2, low2 - high1});
  };
  const auto faces = [&](const Points& hull) {
    for (std::size_t i = 0; i < hull.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        for (std::size_t k = 0; k < j; ++k)
          separation((hull[j] - hull[i]).cross(hull[k] - hull[i]));
  };
  faces(one);
  faces(two);
  for (std::size_t i = 0; i < one.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      for (std::size_t k = 0; k < two.size(); ++k)
        for (std::size_t l = 0; l < k; ++l)
          separation((one[i] - one[j]).cross(two[k] - two[l]));
  return best > 0.0 ? hullHull(one, two) : std::min(best, 0.0);
}

inline Points boxCorners(const Vec3& half, const bullet::Pose& pose) {
  Points corners;
  for (const double x : {-1.0, 1.0})
    for (const double y : {-1.0, 1.0})
      for (const double z : {-1.0, 1.0})
        corners.push_back(pose.toWorld(Vec3(x, y, z).cwiseProduct(half)));
  return corners;
}

/// A convex set, defined by its projection: the set's nearest point to a given one. Its axis is y,
/// through the origin.
struct RoundSet {
  enum class Kind { segment, box, cylinder, cone } kind = Kind::segment;
  double radius = 0.0;
  double halfHeight = 0.0;
  Vec3 half = Vec3::Zero();

  Vec3 project(const Vec3& p) const {
    const double around = std::hypot(p.x(), p.z());
    const Vec3 out = around > 0.0 ? Vec3(p.x() / around, 0.0, p.z() / around) : Vec3(1, 0, 0);
    switch (kind) {
      case Kind::segment:
        return {0.0, std::clamp(p.y(), -halfHeight, halfHeight), 0.0};
      case Kind::box:
        return p.cwiseMax(-half).cwiseMin(half);
      case Kind::cylinder:
        return std::min(around, radius) * out +
               Vec3(0.0, std::clamp(p.y(), -halfHeight, halfHeight), 0.0);
      default:
        return inCone(around, p.y(), out);
    }
  }

 private:
  // In the half plane of radius and height a cone is a triangle, of which the axis is no surface.
  Vec3 inCone(double around, double height, const Vec3& out) const {
    const double slope = 2.0 * halfHeight / radius;
    if (height >= -halfHeight && height <= halfHeight - slope * around)
      return around * out + Vec3(0.0, height, 0.0);
    const Vec3 flat(around, height, 0.0);
    const Vec3 rim(radius, -halfHeight, 0.0);
    const Vec3 onSide = nearestOnSegment(rim, Vec3(0.0, halfHeight, 0.0), flat);
    const Vec3 onBase = nearestOnSegment(rim, Vec3(0.0, -halfHeight, 0.0), flat);
    const Vec3 best = (onSide - flat).norm() < (onBase - flat).norm() ? onSide : onBase;
    return best.x() * out + Vec3(0.0, best.y(), 0.0);
  }
};

/// Distance by alternating projections: each set's nearest point to the other's latest one. It
/// converges from above, slowly if the sets are nearly parallel.
inline double roundRound(const RoundSet& one, const bullet::Pose& pose, const RoundSet& two,
                         const bullet::Pose& otherPose, Vec3& start, int rounds = 20000) {
  double distance = std::numeric_limits<double>::infinity();
  for (int round = 0; round < rounds; ++round) {
    const Vec3 there = otherPose.toWorld(two.project(otherPose.toLocal(start)));
    const Vec3 here = pose.toWorld(one.project(pose.toLocal(there)));
    const double moved = (here - start).norm();
    start = here;
    distance = (here - there).norm();
    if (moved < 1e-15) break;
  }
  return distance;
}

/// The first time at which `gap` is no longer positive, from its values at `pieces` instants and at
/// `hint` (a time, or infinity); a touch between two of these instants is missed.
template <class Gap>
double searchedTouch(Gap gap, double horizon, int pieces, double hint) {
  double low = 0.0;
  for (int i = 1; i <= pieces; ++i) {
    double high = horizon * i / pieces;
    if (low < hint && hint < high && gap(hint) <= 0.0) high = hint;
    if (high != hint && gap(high) > 0.0) {
      low = high;
      continue;
    }
    for (int bit = 0; bit < 36; ++bit) {
      const double middle = 0.5 * (low + high);
      (gap(middle) > 0.0 ? low : high) = middle;
    }
    return high;
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace carom::by_hand
