#include "lab/fit/wall_thickness.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

namespace carom::lab {

namespace {

constexpr std::size_t kRays = 300;
constexpr double kFlat = 0.06;        // of the largest eigenvalue: sides that turn less are one
constexpr double kLongestStep = 2.0;  // at a needle's point the step would have no end

/// Returns the distance along a ray to a triangle, or infinity (Moeller, Trumbore 1997).
double hitDistance(const Vec3& from, const Vec3& direction, const Vec3& a, const Vec3& b,
                   const Vec3& c) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const Vec3 first = b - a;
  const Vec3 second = c - a;
  const Vec3 across = direction.cross(second);
  const double determinant = first.dot(across);
  if (std::abs(determinant) < 1e-300) return kNone;
  const Vec3 offset = from - a;
  const double u = offset.dot(across) / determinant;
  const Vec3 turned = offset.cross(first);
  const double v = direction.dot(turned) / determinant;
  if (u < -1e-9 || v < -1e-9 || u + v > 1.0 + 1e-9) return kNone;
  return second.dot(turned) / determinant;
}

/// The area up to each triangle, by which rays are spread evenly over the surface.
std::vector<double> areasUpTo(const SurfaceMesh& mesh) {
  std::vector<double> sums;
  double sum = 0.0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3 normal =
        (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
    sum += 0.5 * normal.norm();
    sums.push_back(sum);
  }
  return sums;
}

/// Returns the distance from the middle of a triangle inward to the other side.
double thicknessAt(const SurfaceMesh& mesh, std::size_t triangle) {
  const auto& [a, b, c] = mesh.triangles[triangle];
  const Vec3 normal =
      (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
  const Vec3 inward = -normal.normalized();
  // Not the very middle, which may lie above an edge of the other side.
  const Vec3 from = 0.37 * mesh.vertices[a] + 0.34 * mesh.vertices[b] + 0.29 * mesh.vertices[c];
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t other = 0; other < mesh.triangles.size(); ++other) {
    if (other == triangle) continue;
    const auto& [p, q, r] = mesh.triangles[other];
    const double distance =
        hitDistance(from, inward, mesh.vertices[p], mesh.vertices[q], mesh.vertices[r]);
    if (distance > 1e-9) nearest = std::min(nearest, distance);
  }
  return nearest;
}

/// Returns the shortest step that moves all sides around a vertex outward by 1, as far as one step
/// can: on a smooth surface the normal, at the corner of a cube (1, 1, 1). `squares` and `normals`
/// are the sums of n n^T and n over the sides.
Vec3 outwardStep(const Eigen::Matrix3d& squares, const Vec3& normals) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(squares);
  Vec3 step = Vec3::Zero();
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double value = solver.eigenvalues()(axis);
    if (value <= kFlat * solver.eigenvalues()(2)) continue;
    const Vec3 direction = solver.eigenvectors().col(axis);
    step += direction.dot(normals) / value * direction;
  }
  const double length = step.norm();
  return length > kLongestStep ? Vec3(kLongestStep / length * step) : step;
}

}  // namespace

double wallThickness(const SurfaceMesh& mesh) {
  const std::vector<double> areas = areasUpTo(mesh);
  std::vector<double> distances;
  for (std::size_t ray = 0; ray < kRays && !areas.empty(); ++ray) {
    const double place = areas.back() * (static_cast<double>(ray) + 0.5) / kRays;
    const auto triangle =
        static_cast<std::size_t>(std::ranges::lower_bound(areas, place) - areas.begin());
    const double distance = thicknessAt(mesh, std::min(triangle, areas.size() - 1));
    if (std::isfinite(distance)) distances.push_back(distance);
  }
  if (distances.empty()) return 0.0;
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  return *middle;
}

SurfaceMesh thickened(const SurfaceMesh& mesh, double by) {
  std::vector<Eigen::Matrix3d> squares(mesh.vertices.size(), Eigen::Matrix3d::Zero());
  std::vector<Vec3> normals(mesh.vertices.size(), Vec3::Zero());
  for (const auto& corners : mesh.triangles) {
    const Vec3& a = mesh.vertices[corners[0]];
    const Vec3 normal =
        (mesh.vertices[corners[1]] - a).cross(mesh.vertices[corners[2]] - a).normalized();
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const Vec3& at = mesh.vertices[corners.at(corner)];
      const Vec3 next = mesh.vertices[corners.at((corner + 1) % 3)] - at;
      const Vec3 last = mesh.vertices[corners.at((corner + 2) % 3)] - at;
      const double angle = std::atan2(next.cross(last).norm(), next.dot(last));
      if (!normal.allFinite()) continue;
      squares[corners.at(corner)] += angle * normal * normal.transpose();
      normals[corners.at(corner)] += angle * normal;
    }
  }
  SurfaceMesh moved = mesh;
  for (std::size_t vertex = 0; vertex < moved.vertices.size(); ++vertex)
    moved.vertices[vertex] += 0.5 * by * outwardStep(squares[vertex], normals[vertex]);
  return moved;
}

}  // namespace carom::lab
