#include "modal/mesh/mesh_edges.h"

#include <algorithm>
#include <numeric>
#include <tuple>
#include <utility>

namespace carom::modal {
namespace {

constexpr double kSharpCosine = 0.7071067811865476;  // of 45 degrees

std::uint32_t rootOf(std::vector<std::uint32_t>& parent, std::uint32_t vertex) {
  while (parent[vertex] != vertex) {
    parent[vertex] = parent[parent[vertex]];
    vertex = parent[vertex];
  }
  return vertex;
}

}  // namespace

MeshEdges::MeshEdges(const SurfaceMesh& mesh) {
  uses_.reserve(3 * mesh.triangles.size());
  for (std::uint32_t triangle = 0; triangle < mesh.triangles.size(); ++triangle) {
    for (std::size_t side = 0; side < 3; ++side) {
      const std::uint32_t from = mesh.triangles[triangle][side];
      const std::uint32_t to = mesh.triangles[triangle][(side + 1) % 3];
      if (from != to)
        uses_.push_back({std::min(from, to), std::max(from, to), triangle, from < to});
    }
  }
  std::ranges::sort(uses_, {}, [](const EdgeUse& use) {
    return std::tuple(use.low, use.high, use.triangle, use.forward);
  });
  for (std::size_t index = 0; index < uses_.size(); ++index)
    if (index == 0 || uses_[index].low != uses_[index - 1].low ||
        uses_[index].high != uses_[index - 1].high)
      firsts_.push_back(index);
  firsts_.push_back(uses_.size());
}

std::vector<std::uint32_t> partsOf(const SurfaceMesh& mesh) {
  std::vector<std::uint32_t> parent(mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0U);
  for (const auto& [first, second, third] : mesh.triangles) {
    for (const std::uint32_t other : {second, third}) {
      const std::uint32_t one = rootOf(parent, first);
      const std::uint32_t two = rootOf(parent, other);
      parent[std::max(one, two)] = std::min(one, two);
    }
  }
  std::vector<std::uint32_t> part(parent.size());
  std::uint32_t parts = 0;
  for (std::uint32_t vertex = 0; vertex < parent.size(); ++vertex) {
    const std::uint32_t root = rootOf(parent, vertex);  // the least vertex of its part
    part[vertex] = root == vertex ? parts++ : part[root];
  }
  return part;
}

SurfaceMesh withoutUnused(SurfaceMesh mesh) {
  std::vector<std::uint32_t> place(mesh.vertices.size(), 0);
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t corner : triangle)
      place[corner] = 1;
  std::vector<Vec3> kept;
  for (std::size_t vertex = 0; vertex < place.size(); ++vertex) {
    if (place[vertex] == 0) continue;
    place[vertex] = static_cast<std::uint32_t>(kept.size());
    kept.push_back(mesh.vertices[vertex]);
  }
  for (auto& triangle : mesh.triangles)
    for (std::uint32_t& corner : triangle)
      corner = place[corner];
  mesh.vertices = std::move(kept);
  return mesh;
}

std::vector<InnerEdge> sharpInnerEdges(const SurfaceMesh& mesh) {
  const auto corner = [&mesh](std::uint32_t triangle, std::size_t side) -> const Vec3& {
    return mesh.vertices[mesh.triangles[triangle][side]];
  };
  const auto normalOf = [&corner](std::uint32_t triangle) -> Vec3 {
    const Vec3& first = corner(triangle, 0);
    return (corner(triangle, 1) - first).cross(corner(triangle, 2) - first).normalized();
  };
  const MeshEdges edges(mesh);
  std::vector<InnerEdge> found;
  for (std::size_t edge = 0; edge < edges.size(); ++edge) {
    const std::span<const EdgeUse> uses = edges[edge];
    if (uses.size() != 2 || uses[0].forward == uses[1].forward) continue;
    const Vec3 normal = normalOf(uses[0].triangle);
    const Vec3 other = normalOf(uses[1].triangle);
    if (normal.dot(other) >= kSharpCosine) continue;
    const Vec3& low = mesh.vertices[uses[0].low];
    double height = 0.0;  // of the other triangle above the plane of the first
    for (std::size_t side = 0; side < 3; ++side)
      height += normal.dot(corner(uses[1].triangle, side) - low);
    if (height > 0.0) found.push_back({low, mesh.vertices[uses[0].high], {normal, other}});
  }
  return found;
}

double extentOf(const SurfaceMesh& mesh) {
  if (mesh.vertices.empty()) return 0.0;
  Vec3 low = mesh.vertices.front();
  Vec3 high = low;
  for (const Vec3& vertex : mesh.vertices) {
    low = low.cwiseMin(vertex);
    high = high.cwiseMax(vertex);
  }
  return (high - low).maxCoeff();
}

}  // namespace carom::modal
