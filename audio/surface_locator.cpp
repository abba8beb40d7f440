#include "audio/surface_locator.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <numeric>

namespace carom {
namespace {

/// Barycentric coordinates of the point of the triangle abc nearest to p.
std::array<double, 3> nearestInTriangle(const Vec3& p, const Vec3& a, const Vec3& b,
                                        const Vec3& c) {
  const Vec3 ab = b - a;
  const Vec3 ac = c - a;
  const double d1 = ab.dot(p - a);
  const double d2 = ac.dot(p - a);
  if (d1 <= 0.0 && d2 <= 0.0) return {1.0, 0.0, 0.0};
  const double d3 = ab.dot(p - b);
  const double d4 = ac.dot(p - b);
  if (d3 >= 0.0 && d4 <= d3) return {0.0, 1.0, 0.0};
  const double d5 = ab.dot(p - c);
  const double d6 = ac.dot(p - c);
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

}  // namespace

SurfaceLocator::SurfaceLocator(const SurfaceMesh& mesh)
    : mesh_(mesh),
      order_(mesh.vertices.size()),
      axis_(mesh.vertices.size()),
      firstOf_(mesh.vertices.size() + 1) {
  assert(!mesh.vertices.empty());
  std::iota(order_.begin(), order_.end(), 0u);
  build(0, order_.size());
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t vertex : triangle)
      ++firstOf_[vertex + 1];
  std::partial_sum(firstOf_.begin(), firstOf_.end(), firstOf_.begin());
  triangles_.resize(firstOf_.back());
  std::vector<std::uint32_t> next(firstOf_.begin(), firstOf_.end() - 1);
  for (std::uint32_t index = 0; index < mesh.triangles.size(); ++index)
    for (const std::uint32_t vertex : mesh.triangles[index])
      triangles_[next[vertex]++] = index;
}

/// The middle one of [begin, end) along the longest side of their box, and so on in both halves.
void SurfaceLocator::build(std::size_t begin, std::size_t end) {
  if (end - begin < 2) return;
  Eigen::AlignedBox3d box;
  for (std::size_t at = begin; at < end; ++at)
    box.extend(mesh_.vertices[order_[at]]);
  Eigen::Index axis = 0;
  box.sizes().maxCoeff(&axis);
  const std::size_t middle = begin + (end - begin) / 2;
  const auto at = [this](std::size_t index) {
    return order_.begin() + static_cast<std::ptrdiff_t>(index);
  };
  std::nth_element(at(begin), at(middle), at(end), [this, axis](auto a, auto b) {
    const double xa = mesh_.vertices[a][axis];
    const double xb = mesh_.vertices[b][axis];
    return xa != xb ? xa < xb : a < b;
  });
  axis_[middle] = static_cast<std::uint8_t>(axis);
  build(begin, middle);
  build(middle + 1, end);
}

void SurfaceLocator::search(const Vec3& point, std::size_t begin, std::size_t end,
                            Best& best) const {
  if (begin >= end) return;
  const std::size_t middle = begin + (end - begin) / 2;
  const std::uint32_t vertex = order_[middle];
  const double distance2 = (mesh_.vertices[vertex] - point).squaredNorm();
  if (distance2 < best.distance2 || (distance2 == best.distance2 && vertex < best.vertex))
    best = {distance2, vertex};
  const int axis = axis_[middle];
  const double beyond = point[axis] - mesh_.vertices[vertex][axis];
  const bool left = beyond < 0.0;
  search(point, left ? begin : middle + 1, left ? middle : end, best);
  if (beyond * beyond <= best.distance2)
    search(point, left ? middle + 1 : begin, left ? end : middle, best);
}

std::uint32_t SurfaceLocator::nearestVertex(const Vec3& point) const {
  Best best{std::numeric_limits<double>::infinity(), order_.front()};
  search(point, 0, order_.size(), best);
  return best.vertex;
}

SurfacePoint SurfaceLocator::nearest(const Vec3& point) const {
  const std::uint32_t vertex = nearestVertex(point);
  SurfacePoint found{{vertex, vertex, vertex}, {1.0, 0.0, 0.0}};
  double least = std::numeric_limits<double>::infinity();
  for (std::uint32_t at = firstOf_[vertex]; at < firstOf_[vertex + 1]; ++at) {
    const auto& corners = mesh_.triangles[triangles_[at]];
    const Vec3& a = mesh_.vertices[corners[0]];
    const Vec3& b = mesh_.vertices[corners[1]];
    const Vec3& c = mesh_.vertices[corners[2]];
    const std::array<double, 3> weights = nearestInTriangle(point, a, b, c);
    if (!(weights[0] + weights[1] + weights[2] < 2.0)) continue;  // NaN: it has no area
    const double distance2 =
        (weights[0] * a + weights[1] * b + weights[2] * c - point).squaredNorm();
    if (distance2 < least) {
      least = distance2;
      found = {corners, weights};
    }
  }
  return found;
}

}  // namespace carom
