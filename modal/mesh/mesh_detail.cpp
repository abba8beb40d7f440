#include "modal/mesh/mesh_detail.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "audio/model/positive.h"
#include "modal/mesh/mesh_edges.h"

namespace carom::modal {

using namespace audio;

namespace {

using Triangle = std::array<std::uint32_t, 3>;

constexpr std::uint32_t kNoVertex = std::numeric_limits<std::uint32_t>::max();
constexpr double kNearlyLongest = 0.75;  // of the longest edge; longer ones are halved too

double lengthOf(const SurfaceMesh& mesh, const EdgeUse& edge) {
  return (mesh.vertices[edge.high] - mesh.vertices[edge.low]).norm();
}

double longestEdge(const SurfaceMesh& mesh, const MeshEdges& edges) {
  double longest = 0.0;
  for (std::size_t edge = 0; edge < edges.size(); ++edge)
    longest = std::max(longest, lengthOf(mesh, edges[edge][0]));
  return longest;
}

/// The middles of a triangle's sides (from each corner to the next), or kNoVertex.
using Middles = std::array<std::uint32_t, 3>;

/// Puts a vertex into the middle of each edge longer than `longest`.
std::vector<Middles> addMiddles(SurfaceMesh& mesh, const MeshEdges& edges, double longest) {
  std::vector<Middles> middles(mesh.triangles.size(), {kNoVertex, kNoVertex, kNoVertex});
  for (std::size_t edge = 0; edge < edges.size(); ++edge) {
    if (!(lengthOf(mesh, edges[edge][0]) > longest)) continue;
    const auto middle = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const EdgeUse& use : edges[edge]) {
      const Triangle& triangle = mesh.triangles[use.triangle];
      const std::uint32_t from = use.forward ? use.low : use.high;
      for (std::size_t side = 0; side < 3; ++side)
        if (triangle[side] == from) middles[use.triangle][side] = middle;
    }
    const EdgeUse& ends = edges[edge][0];
    mesh.vertices.emplace_back(0.5 * (mesh.vertices[ends.low] + mesh.vertices[ends.high]));
  }
  return middles;
}

/// Rotates the triangle so that its longest side is the first.
void turnToLongest(const SurfaceMesh& mesh, Triangle& triangle, Middles& middles) {
  std::array<double, 3> lengths{};
  for (std::size_t side = 0; side < 3; ++side)
    lengths[side] =
        (mesh.vertices[triangle[(side + 1) % 3]] - mesh.vertices[triangle[side]]).norm();
  const auto shift = std::ranges::max_element(lengths) - lengths.begin();
  std::rotate(triangle.begin(), triangle.begin() + shift, triangle.end());
  std::rotate(middles.begin(), middles.begin() + shift, middles.end());
}

/// Splits a triangle at its middles. Its longest side is halved if any is.
void split(const SurfaceMesh& mesh, Triangle triangle, Middles middles,
           std::vector<Triangle>& pieces) {
  turnToLongest(mesh, triangle, middles);
  const auto [a, b, c] = triangle;
  const auto [ab, bc, ca] = middles;
  if (ab == kNoVertex) {
    pieces.push_back(triangle);
  } else if (bc != kNoVertex && ca != kNoVertex) {
    pieces.insert(pieces.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
  } else if (bc != kNoVertex) {
    pieces.insert(pieces.end(), {{a, ab, c}, {ab, b, bc}, {ab, bc, c}});
  } else if (ca != kNoVertex) {
    pieces.insert(pieces.end(), {{ab, b, c}, {a, ab, ca}, {ab, c, ca}});
  } else {
    pieces.insert(pieces.end(), {{a, ab, c}, {ab, b, c}});
  }
}

/// Halves all edges longer than `longest` once; false if there are none.
bool halve(SurfaceMesh& mesh, const MeshEdges& edges, double longest) {
  const std::size_t before = mesh.vertices.size();
  const std::vector<Middles> middles = addMiddles(mesh, edges, longest);
  if (mesh.vertices.size() == before) return false;
  std::vector<Triangle> pieces;
  pieces.reserve(2 * mesh.triangles.size());
  for (std::size_t index = 0; index < mesh.triangles.size(); ++index)
    split(mesh, mesh.triangles[index], middles[index], pieces);
  mesh.triangles = std::move(pieces);
  return true;
}

Error tooMany() {
  return Error{"subdivision: it would give more than " + std::to_string(kMostTriangles) +
               " triangles; expected longer edges, or fewer vertices"};
}

}  // namespace

Result<SurfaceMesh> subdivided(const SurfaceMesh& mesh, double longestEdge) {
  if (!isPositive(longestEdge)) return Error{"subdivision: the longest edge must be positive (m)"};
  // No triangle with edges up to `longestEdge` is larger than the equilateral one.
  const double largest = 0.25 * std::sqrt(3.0) * longestEdge * longestEdge;
  if (surfaceArea(mesh) > static_cast<double>(kMostTriangles) * largest) return tooMany();
  SurfaceMesh fine = mesh;
  while (halve(fine, MeshEdges(fine), longestEdge))
    if (fine.triangles.size() > kMostTriangles) return tooMany();
  return fine;
}

Result<SurfaceMesh> subdividedTo(const SurfaceMesh& mesh, std::size_t least) {
  SurfaceMesh fine = mesh;
  while (fine.vertices.size() < least) {
    const MeshEdges edges(fine);
    const double longest = longestEdge(fine, edges);
    if (!(longest > 0.0) || !halve(fine, edges, kNearlyLongest * longest)) break;
    if (fine.triangles.size() > kMostTriangles) return tooMany();
  }
  return fine;
}

}  // namespace carom::modal
