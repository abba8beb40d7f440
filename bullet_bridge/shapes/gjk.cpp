#include "bullet_bridge/shapes/gjk.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace carom::bullet {
namespace {

constexpr int kMaxIterations = 100;
constexpr double kTolerance = 1e-12;
constexpr double kSimplexRounding = 4.0 * std::numeric_limits<double>::epsilon();

// A corner of the Minkowski difference of the two cores, and the two points that it is made of, in
// the frames of their pieces.
struct Corner {
  Vec3 difference = Vec3::Zero();
  Vec3 body = Vec3::Zero();
  Vec3 other = Vec3::Zero();
};

struct Simplex {
  std::array<Corner, 4> corners;
  std::size_t count = 0;

  const Vec3& at(std::size_t i) const { return corners[i].difference; }
};

// The point of (part of) a simplex that is nearest to the origin.
struct Nearest {
  Vec3 point = Vec3::Zero();
  std::array<double, 4> weights{};
  double squared = std::numeric_limits<double>::infinity();

  void keepNearer(const Nearest& candidate) {
    if (candidate.squared < squared) *this = candidate;
  }
};

Nearest nearestOnSegment(const Simplex& simplex, std::size_t i, std::size_t j) {
  const Vec3& start = simplex.at(i);
  const Vec3 edge = simplex.at(j) - start;
  const double length = edge.squaredNorm();
  const double place = length > 0.0 ? std::clamp(-start.dot(edge) / length, 0.0, 1.0) : 0.0;
  Nearest nearest;
  nearest.weights[i] = 1.0 - place;
  nearest.weights[j] = place;
  nearest.point = place == 1.0 ? simplex.at(j) : Vec3(start + place * edge);
  nearest.squared = nearest.point.squaredNorm();
  return nearest;
}

Nearest nearestOnTriangle(const Simplex& simplex, std::size_t i, std::size_t j, std::size_t k) {
  const Vec3& start = simplex.at(i);
  const Vec3 first = simplex.at(j) - start;
  const Vec3 second = simplex.at(k) - start;
  const Vec3 normal = first.cross(second);
  const double squared = normal.squaredNorm();
  const double flat =
      kSimplexRounding * kSimplexRounding * first.squaredNorm() * second.squaredNorm();
  Nearest nearest;
  double atFirst = -1.0, atSecond = -1.0, atStart = -1.0;
  if (squared > flat) {
    atFirst = -normal.dot(start.cross(second)) / squared;
    atSecond = -normal.dot(first.cross(start)) / squared;
    atStart = 1.0 - atFirst - atSecond;
  }
  if (atFirst >= 0.0 && atSecond >= 0.0 && atStart >= 0.0) {
    nearest.weights[i] = atStart;
    nearest.weights[j] = atFirst;
    nearest.weights[k] = atSecond;
    // The triangle's normal gives the direction of its nearest point best, but it is rounded where
    // the triangle is small or thin and far.
    const double height = start.dot(normal);
    const double longest = std::max(first.squaredNorm(), second.squaredNorm());
    const bool near = height * height * longest < squared * squared;
    nearest.point = near ? Vec3((height / squared) * normal)
                         : Vec3(start + atFirst * first + atSecond * second);
    nearest.squared = nearest.point.squaredNorm();
    return nearest;
  }
  if (atSecond < 0.0) nearest.keepNearer(nearestOnSegment(simplex, i, j));
  if (atFirst < 0.0) nearest.keepNearer(nearestOnSegment(simplex, i, k));
  if (atStart < 0.0) nearest.keepNearer(nearestOnSegment(simplex, j, k));
  return nearest;
}

Nearest nearestInTetrahedron(const Simplex& simplex) {
  const Vec3& start = simplex.at(0);
  const Vec3 first = simplex.at(1) - start;
  const Vec3 second = simplex.at(2) - start;
  const Vec3 third = simplex.at(3) - start;
  const double volume = first.dot(second.cross(third));
  const double flat = kSimplexRounding * first.norm() * second.norm() * third.norm();
  std::array<double, 4> weights{-1.0, -1.0, -1.0, -1.0};
  if (std::abs(volume) > flat) {
    weights[1] = -start.dot(second.cross(third)) / volume;
    weights[2] = -start.dot(third.cross(first)) / volume;
    weights[3] = -start.dot(first.cross(second)) / volume;
    weights[0] = 1.0 - weights[1] - weights[2] - weights[3];
  }
  Nearest nearest;
  if (weights[0] < 0.0) nearest.keepNearer(nearestOnTriangle(simplex, 1, 2, 3));
  if (weights[1] < 0.0) nearest.keepNearer(nearestOnTriangle(simplex, 0, 2, 3));
  if (weights[2] < 0.0) nearest.keepNearer(nearestOnTriangle(simplex, 0, 1, 3));
  if (weights[3] < 0.0) nearest.keepNearer(nearestOnTriangle(simplex, 0, 1, 2));
  if (*std::min_element(weights.begin(), weights.end()) >= 0.0) {
    nearest.weights = weights;
    nearest.squared = 0.0;
  }
  return nearest;
}

Nearest nearestInSimplex(const Simplex& simplex) {
  switch (simplex.count) {
    case 2:
      return nearestOnSegment(simplex, 0, 1);
    case 3:
      return nearestOnTriangle(simplex, 0, 1, 2);
    default:
      return nearestInTetrahedron(simplex);
  }
}

// Keeps the corners that the nearest point is made of.
void reduce(Simplex& simplex, Nearest& nearest) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < simplex.count; ++i) {
    if (!(nearest.weights[i] > 0.0)) continue;
    if (kept != i) simplex.corners[kept] = simplex.corners[i];
    nearest.weights[kept++] = nearest.weights[i];
  }
  simplex.count = kept;
}

Corner cornerOf(const PlacedPiece& body, const PlacedPiece& other, const Vec3& bodyPoint,
                const Vec3& otherPoint) {
  return {body.toWorld(bodyPoint) - other.toWorld(otherPoint), bodyPoint, otherPoint};
}

Corner cornerAgainst(const PlacedPiece& body, const PlacedPiece& other, const Vec3& direction) {
  return cornerOf(body, other, body.piece->support(body.rotation.transpose() * -direction),
                  other.piece->support(other.rotation.transpose() * direction));
}

bool holds(const Simplex& simplex, const Vec3& difference) {
  for (std::size_t i = 0; i < simplex.count; ++i) {
    if (simplex.at(i) == difference) return true;
  }
  return false;
}

Corner nearestCorner(const Simplex& simplex, const Nearest& nearest) {
  Corner corner{nearest.point, Vec3::Zero(), Vec3::Zero()};
  for (std::size_t i = 0; i < simplex.count; ++i) {
    corner.body += nearest.weights[i] * simplex.corners[i].body;
    corner.other += nearest.weights[i] * simplex.corners[i].other;
  }
  return corner;
}

// Begins with the corners that the nearest point was made of when the pair was looked at last.
Nearest begin(Simplex& simplex, const PlacedPiece& body, const PlacedPiece& other,
              const DistanceSearch& search) {
  const NearestCorners* const corners = search.corners;
  Nearest nearest;
  simplex.count = corners != nullptr ? corners->count : 0;
  for (std::size_t i = 0; i < simplex.count; ++i)
    simplex.corners[i] = cornerOf(body, other, corners->corners[i].body, corners->corners[i].other);
  if (simplex.count > 1) {
    nearest = nearestInSimplex(simplex);
    reduce(simplex, nearest);
  }
  if (simplex.count > 1) return nearest;
  if (simplex.count == 0) simplex.corners[0] = cornerAgainst(body, other, search.guess);
  simplex.count = 1;
  nearest.point = simplex.at(0);
  nearest.weights[0] = 1.0;
  nearest.squared = nearest.point.squaredNorm();
  return nearest;
}

void keep(const Simplex& simplex, NearestCorners* corners) {
  if (corners == nullptr) return;
  corners->count = simplex.count;
  for (std::size_t i = 0; i < simplex.count; ++i)
    corners->corners[i] = {simplex.corners[i].body, simplex.corners[i].other};
}

CoreDistance fromSimplex(const PlacedPiece& body, const PlacedPiece& other, const Corner& corner,
                         const Nearest& nearest, double overlap) {
  CoreDistance result;
  result.point = body.toWorld(corner.body);
  result.otherPoint = other.toWorld(corner.other);
  const double distance = std::sqrt(nearest.squared);
  if (distance <= overlap) return result;  // false for NaN, which stays NaN
  result.distance = distance;
  result.normal = nearest.point / distance;
  return result;
}

CoreDistance aboveHalfSpace(const PlacedPiece& body, const PlacedPiece& plane) {
  CoreDistance result;
  result.normal = plane.rotation * plane.piece->planeNormal();
  result.point = body.support(-result.normal);
  result.distance = result.normal.dot(result.point - plane.position) - plane.piece->planeConstant();
  result.otherPoint = result.point - result.distance * result.normal;
  return result;
}

}  // namespace

CoreDistance coreDistance(const PlacedPiece& body, const PlacedPiece& other,
                          const DistanceSearch& search) {
  if (other.piece->core() == ConvexPiece::Core::halfSpace) return aboveHalfSpace(body, other);
  if (body.piece->core() == ConvexPiece::Core::halfSpace) {
    CoreDistance result = aboveHalfSpace(other, body);
    result.normal = -result.normal;
    std::swap(result.point, result.otherPoint);
    return result;
  }
  const double size = body.piece->coreBall() + other.piece->coreBall();
  Simplex simplex;
  Nearest nearest = begin(simplex, body, other, search);
  const double overlap = kSimplexRounding * size;
  const double margins = body.piece->margin() + other.piece->margin();
  int iteration = 0;
  for (; iteration < kMaxIterations && nearest.squared > overlap * overlap; ++iteration) {
    const Corner corner = cornerAgainst(body, other, nearest.point);
    const double excess = nearest.squared - nearest.point.dot(corner.difference);
    const double length = std::sqrt(nearest.squared);
    const double tolerated =
        std::max({kTolerance * nearest.squared, kSimplexRounding * size * length,
                  search.gapTolerance * (nearest.squared - margins * length)});
    if (!(excess > tolerated)) break;
    if (nearest.point.dot(corner.difference) > search.farthest * length) break;
    if (holds(simplex, corner.difference)) break;
    const std::size_t count = simplex.count;
    simplex.corners[simplex.count++] = corner;
    Nearest better = nearestInSimplex(simplex);
    if (!(better.squared < nearest.squared)) {
      // The simplex is too thin for its digits: go on from its nearest point alone.
      simplex.count = count;
      Simplex line;
      line.corners[0] = nearestCorner(simplex, nearest);
      line.corners[1] = corner;
      line.count = 2;
      better = nearestInSimplex(line);
      if (!(better.squared < nearest.squared)) break;
      simplex = line;
    }
    reduce(simplex, better);
    nearest = better;
  }
  keep(simplex, search.corners);
  CoreDistance result = fromSimplex(body, other, nearestCorner(simplex, nearest), nearest, overlap);
  result.iterations = iteration;
  return result;
}

}  // namespace carom::bullet
