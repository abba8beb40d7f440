#include "modal/radiation/mirror_part.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "modal/mesh/triangle_points.h"

namespace carom::modal {
namespace {

constexpr double kSame = 1e-6;  // of the extent

Vec3 flipped(Vec3 point, Eigen::Index axis) {
  point[axis] *= -1.0;
  return point;
}

/// True if a point, with this normal, is on the surface.
bool holds(const SurfaceMesh& surface, const Vec3& point, const Vec3& normal, double tolerance) {
  for (std::size_t triangle = 0; triangle < surface.triangles.size(); ++triangle) {
    const std::array<Vec3, 3> corners = cornersOf(surface, triangle);
    const Vec3 own = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
    if (own.dot(normal) < 0.999 || std::abs((point - corners[0]).dot(own)) > tolerance) continue;
    if ((pointOf(corners, closestOnTriangle(corners, point)) - point).norm() <= tolerance)
      return true;
  }
  return false;
}

bool isMirror(const SurfaceMesh& surface, Eigen::Index axis, double tolerance) {
  const auto hasImage = [&](const Vec3& vertex) {
    const Vec3 image = flipped(vertex, axis);
    return std::ranges::any_of(surface.vertices, [&](const Vec3& other) {
      return (other - image).squaredNorm() <= tolerance * tolerance;
    });
  };
  if (!std::ranges::all_of(surface.vertices, hasImage)) return false;
  for (std::size_t triangle = 0; triangle < surface.triangles.size(); ++triangle) {
    const std::array<Vec3, 3> corners = cornersOf(surface, triangle);
    const Vec3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
    const Vec3 centre = (corners[0] + corners[1] + corners[2]) / 3.0;
    if (!holds(surface, flipped(centre, axis), flipped(normal, axis), tolerance)) return false;
  }
  return true;
}

/// Returns a polygon's part where a coordinate is positive (Sutherland and Hodgman 1974).
std::vector<Vec3> clipped(const std::vector<Vec3>& polygon, Eigen::Index axis, double tolerance) {
  std::vector<Vec3> part;
  for (std::size_t corner = 0; corner < polygon.size(); ++corner) {
    const Vec3& here = polygon[corner];
    const Vec3& next = polygon[(corner + 1) % polygon.size()];
    if (here[axis] >= -tolerance) part.push_back(here);
    if (std::min(here[axis], next[axis]) < -tolerance &&
        std::max(here[axis], next[axis]) > tolerance) {
      part.push_back(here + here[axis] / (here[axis] - next[axis]) * (next - here));
      part.back()[axis] = 0.0;
    }
  }
  return part;
}

/// Adds a convex polygon as triangles, those without an area left out.
void addPolygon(const std::vector<Vec3>& polygon, double leastArea, SurfaceMesh& mesh) {
  for (std::size_t corner = 2; corner < polygon.size(); ++corner) {
    const Vec3 area = (polygon[corner - 1] - polygon[0]).cross(polygon[corner] - polygon[0]);
    if (area.norm() <= leastArea) continue;
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), {polygon[0], polygon[corner - 1], polygon[corner]});
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
}

}  // namespace

MirrorPart mirrorPart(const SurfaceMesh& surface) {
  Vec3 extent = Vec3::Zero();
  for (const Vec3& vertex : surface.vertices)
    extent = extent.cwiseMax(vertex.cwiseAbs());
  const double tolerance = kSame * extent.maxCoeff();
  MirrorPart result;
  result.area = surfaceArea(surface);
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    result.mirrors[static_cast<std::size_t>(axis)] = isMirror(surface, axis, tolerance);
  for (std::size_t triangle = 0; triangle < surface.triangles.size(); ++triangle) {
    const std::array<Vec3, 3> corners = cornersOf(surface, triangle);
    std::vector<Vec3> polygon(corners.begin(), corners.end());
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      if (result.mirrors[static_cast<std::size_t>(axis)])
        polygon = clipped(polygon, axis, tolerance);
    addPolygon(polygon, tolerance * tolerance, result.part);
  }
  return result;
}

}  // namespace carom::modal
