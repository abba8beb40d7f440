#include "carom/audio/surface_mesh.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

#include <Eigen/LU>

namespace carom {
namespace {

// Six times the volume of the tetrahedron on a triangle, and its corners' sum, both relative to the
// apex: with an apex near the surface less precision is lost than with a far origin.
struct Tetrahedron {
  double sixfold;
  Vec3 sum;
};

Vec3 apexOf(const SurfaceMesh& mesh) {
  return mesh.vertices.empty() ? Vec3::Zero() : mesh.vertices.front();
}

Tetrahedron tetrahedronOn(const SurfaceMesh& mesh, const std::array<std::uint32_t, 3>& triangle,
                          const Vec3& apex) {
  const Vec3 a = mesh.vertices[triangle[0]] - apex;
  const Vec3 b = mesh.vertices[triangle[1]] - apex;
  const Vec3 c = mesh.vertices[triangle[2]] - apex;
  return {a.dot(b.cross(c)), a + b + c};
}

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
constexpr double kCell = 4.0;  // side over distance: mostly one cell is within reach of a point

/// A grid whose cells hold points. Each cell has one of a fixed number of lists; two cells may
/// share one, which costs time and nothing else.
class PointGrid {
 public:
  PointGrid(const std::vector<Vec3>& points, double distance)
      : points_(points),
        distance_(distance),
        last_(std::bit_ceil(2 * points.size() + 1), kNone),
        before_(points.size(), kNone),
        turn_(points.size(), 0) {}

  void put(std::uint32_t point) {
    std::uint32_t& last = last_[listOf(cellOf(points_[point]))];
    before_[point] = last;
    last = point;
    turn_[point] = ++turns_;
  }

  /// Returns the point put last among those within the distance of `point`, or kNone.
  std::uint32_t lastNear(const Vec3& point) const {
    const Vec3 low = cellOf(point - Vec3::Constant(distance_));
    const Vec3 high = cellOf(point + Vec3::Constant(distance_));
    std::uint32_t found = kNone;
    for (unsigned corner = 0; corner < 8; ++corner) {
      Vec3 cell = low;
      for (int axis = 0; axis < 3; ++axis)
        if ((corner >> axis & 1U) != 0) cell[axis] = high[axis];
      found = later(found, lastNear(point, listOf(cell)));
      if (low == high) break;
    }
    return found;
  }

 private:
  Vec3 cellOf(const Vec3& point) const {
    if (!(distance_ > 0.0)) return point;
    return (point / (kCell * distance_)).array().floor();
  }

  std::size_t listOf(const Vec3& cell) const {
    std::uint64_t hash = 0;
    for (const double coordinate : cell) {
      hash ^= std::bit_cast<std::uint64_t>(coordinate + 0.0);  // turns -0 into 0
      hash *= 0x9e3779b97f4a7c15U;
      hash ^= hash >> 32U;
    }
    return hash & (last_.size() - 1);
  }

  std::uint32_t lastNear(const Vec3& point, std::size_t list) const {
    std::uint32_t other = last_[list];
    while (other != kNone && !((points_[other] - point).norm() <= distance_))
      other = before_[other];
    return other;
  }

  std::uint32_t later(std::uint32_t one, std::uint32_t other) const {
    if (one == kNone || other == kNone) return one == kNone ? other : one;
    return turn_[one] > turn_[other] ? one : other;
  }

  const std::vector<Vec3>& points_;
  double distance_;
  std::vector<std::uint32_t> last_;    // last point of each list
  std::vector<std::uint32_t> before_;  // for each point, the one put before it into its list
  std::vector<std::uint32_t> turn_;    // for each point, when it was put
  std::uint32_t turns_ = 0;
};

}  // namespace

std::array<double, 3> nearestInTriangle(const Vec3& point, const Vec3& a, const Vec3& b,
                                        const Vec3& c) {
  const Vec3 ab = b - a;
  const Vec3 ac = c - a;
  const double d1 = ab.dot(point - a);
  const double d2 = ac.dot(point - a);
  if (d1 <= 0.0 && d2 <= 0.0) return {1.0, 0.0, 0.0};
  const double d3 = ab.dot(point - b);
  const double d4 = ac.dot(point - b);
  if (d3 >= 0.0 && d4 <= d3) return {0.0, 1.0, 0.0};
  const double d5 = ab.dot(point - c);
  const double d6 = ac.dot(point - c);
  if (d6 >= 0.0 && d5 <= d6) return {0.0, 0.0, 1.0};
  const double areaC = d1 * d4 - d3 * d2;
  if (areaC <= 0.0 && d1 >= 0.0 && d3 <= 0.0) {
    const double t = d1 / (d1 - d3);
    return {1.0 - t, t, 0.0};
  }
  const double areaB = d5 * d2 - d1 * d6;
  if (areaB <= 0.0 && d2 >= 0.0 && d6 <= 0.0) {
    const double t = d2 / (d2 - d6);
    return {1.0 - t, 0.0, t};
  }
  const double areaA = d3 * d6 - d5 * d4;
  if (areaA <= 0.0 && d4 >= d3 && d5 >= d6) {
    const double t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0.0, 1.0 - t, t};
  }
  const double area = areaA + areaB + areaC;
  return {areaA / area, areaB / area, areaC / area};
}

double signedVolume(const SurfaceMesh& mesh) {
  double sixfold = 0.0;
  for (const auto& triangle : mesh.triangles)
    sixfold += tetrahedronOn(mesh, triangle, apexOf(mesh)).sixfold;
  return sixfold / 6.0;
}

Vec3 volumeCentroid(const SurfaceMesh& mesh) {
  double sixfold = 0.0;
  Vec3 moment = Vec3::Zero();
  for (const auto& triangle : mesh.triangles) {
    const Tetrahedron part = tetrahedronOn(mesh, triangle, apexOf(mesh));
    sixfold += part.sixfold;
    moment += 0.25 * part.sixfold * part.sum;
  }
  return apexOf(mesh) + moment / sixfold;
}

Eigen::Matrix3d secondMoment(const SurfaceMesh& mesh, const Vec3& from) {
  Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
  for (const auto& triangle : mesh.triangles) {
    // A tetrahedron with one corner at the origin has V / 20 (sum of x x^T + s s^T), with its other
    // corners x and their sum s.
    Eigen::Matrix3d corners;
    for (Eigen::Index corner = 0; corner < 3; ++corner)
      corners.col(corner) = mesh.vertices[triangle[static_cast<std::size_t>(corner)]] - from;
    const Vec3 sum = corners.rowwise().sum();
    moment +=
        corners.determinant() / 120.0 * (corners * corners.transpose() + sum * sum.transpose());
  }
  return moment;
}

double surfaceArea(const SurfaceMesh& mesh) {
  double twofold = 0.0;
  for (const auto& [first, second, third] : mesh.triangles) {
    const Vec3& corner = mesh.vertices[first];
    twofold += (mesh.vertices[second] - corner).cross(mesh.vertices[third] - corner).norm();
  }
  return 0.5 * twofold;
}

bool closedSurface(const SurfaceMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> balance;
  for (const auto& triangle : mesh.triangles) {
    for (std::size_t side = 0; side < 3; ++side) {
      const std::uint32_t from = triangle[side];
      const std::uint32_t to = triangle[(side + 1) % 3];
      if (from < to) ++balance[{from, to}];
      if (to < from) --balance[{to, from}];
    }
  }
  for (const auto& [edge, surplus] : balance) {
    if (surplus != 0) return false;
  }
  return true;
}

std::vector<std::uint32_t> coincident(const std::vector<Vec3>& points, double distance) {
  std::vector<std::uint32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0U);
  std::vector<std::uint32_t> stands = order;
  std::sort(order.begin(), order.end(), [&](std::uint32_t left, std::uint32_t right) {
    return std::pair(points[left].x(), left) < std::pair(points[right].x(), right);
  });
  PointGrid grid(points, distance);
  for (const std::uint32_t point : order) {
    const std::uint32_t near = grid.lastNear(points[point]);
    if (near != kNone) stands[point] = stands[near];
    grid.put(point);
  }
  return stands;
}

SurfaceMesh welded(const SurfaceMesh& mesh, double tolerance, std::vector<std::uint32_t>* kept) {
  const std::vector<std::uint32_t> names = coincident(mesh.vertices, tolerance);
  std::vector<std::uint32_t> place(mesh.vertices.size(), kNone);
  SurfaceMesh result;
  if (kept != nullptr) kept->clear();
  for (std::uint32_t index = 0; index < mesh.triangles.size(); ++index) {
    const auto& triangle = mesh.triangles[index];
    std::array<std::uint32_t, 3> now{};
    std::transform(triangle.begin(), triangle.end(), now.begin(),
                   [&](std::uint32_t corner) { return names[corner]; });
    if (now[0] == now[1] || now[1] == now[2] || now[2] == now[0]) continue;
    for (std::uint32_t& corner : now) {
      if (place[corner] == kNone) {
        place[corner] = static_cast<std::uint32_t>(result.vertices.size());
        result.vertices.push_back(mesh.vertices[corner]);
      }
      corner = place[corner];
    }
    result.triangles.push_back(now);
    if (kept != nullptr) kept->push_back(index);
  }
  return result;
}

}  // namespace carom
