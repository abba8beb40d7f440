#include "audio/radiation/panel_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <set>
#include <string>
#include <utility>

#include <Eigen/Eigenvalues>

#include "audio/radiation/edge_collapse.h"
#include "audio/radiation/source_panel.h"

namespace carom::audio {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

constexpr double kWeld = 1e-6;      // share of the extent
constexpr double kNoArea = 1e-12;   // share of the extent squared
constexpr double kNoVolume = 1e-9;  // share of the extent cubed
constexpr double kMostLost = 0.02;  // share of the volume that clustering may lose or gain
// Shares of the extent that a simplified surface may be off the planes of the mesh; the least
// serves that suffices.
constexpr std::array kDeviations = {1e-4, 1e-3, 1e-2};
constexpr double kBackToBack = -0.999;  // cosine between the normals of neighbours
constexpr double kFlatQuadric = 0.01;   // an eigenvalue below this share of the largest is noise

std::uint32_t index(std::size_t i) {
  return static_cast<std::uint32_t>(i);
}

std::array<Vec3, 3> cornersOf(const SurfaceMesh& mesh, const Triangle& triangle) {
  return {mesh.vertices[triangle[0]], mesh.vertices[triangle[1]], mesh.vertices[triangle[2]]};
}

Vec3 twiceAreaOf(const SurfaceMesh& mesh, const Triangle& triangle) {
  const auto [a, b, c] = cornersOf(mesh, triangle);
  return (b - a).cross(c - a);
}

double extentOf(const SurfaceMesh& mesh) {
  Vec3 low = mesh.vertices.front();
  Vec3 high = low;
  for (const Triangle& triangle : mesh.triangles) {
    for (const Vec3& corner : cornersOf(mesh, triangle)) {
      low = low.cwiseMin(corner);
      high = high.cwiseMax(corner);
    }
  }
  return (high - low).maxCoeff();
}

Status checkNumbers(const SurfaceMesh& mesh) {
  if (mesh.triangles.empty()) return Error{"surface: it has no triangles; expected a closed mesh"};
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const std::uint32_t corner : mesh.triangles[t]) {
      if (corner >= mesh.vertices.size()) {
        return Error{"surface: triangle " + std::to_string(t) + " names vertex " +
                     std::to_string(corner) + " of " + std::to_string(mesh.vertices.size())};
      }
      if (!mesh.vertices[corner].allFinite()) {
        return Error{"surface: vertex " + std::to_string(corner) + " is not finite"};
      }
    }
  }
  return std::monostate{};
}

bool degenerate(const Triangle& triangle) {
  return triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0];
}

// Returns the triangle starting at its least index, so that equal triangles compare equal.
Triangle leastFirst(Triangle triangle) {
  std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()), triangle.end());
  return triangle;
}

// Renames vertices; drops triangles that vanish and pairs that lie back to back.
std::vector<Triangle> renamed(const std::vector<Triangle>& triangles,
                              const std::vector<std::uint32_t>& name) {
  std::map<Triangle, int> count;
  for (const Triangle& triangle : triangles) {
    const Triangle now = leastFirst({name[triangle[0]], name[triangle[1]], name[triangle[2]]});
    if (degenerate(now)) continue;
    const Triangle back = {now[0], now[2], now[1]};
    const auto found = count.find(back);
    if (found != count.end() && found->second > 0) {
      --found->second;
    } else {
      ++count[now];
    }
  }
  std::vector<Triangle> kept;
  for (const auto& [triangle, times] : count)
    kept.insert(kept.end(), static_cast<std::size_t>(times), triangle);
  return kept;
}

// Counts the edges that are not passed as often one way as the other.
std::size_t openEdges(const SurfaceMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> balance;
  for (const Triangle& triangle : mesh.triangles) {
    for (std::size_t side = 0; side < 3; ++side) {
      const auto [from, to] = std::pair(triangle[side], triangle[(side + 1) % 3]);
      balance[std::minmax(from, to)] += from < to ? 1 : -1;
    }
  }
  return static_cast<std::size_t>(std::count_if(
      balance.begin(), balance.end(), [](const auto& entry) { return entry.second != 0; }));
}

std::uint32_t rootOf(std::vector<std::uint32_t>& parent, std::uint32_t i) {
  while (parent[i] != i) {
    parent[i] = parent[parent[i]];
    i = parent[i];
  }
  return i;
}

// Returns the parts that are connected by vertices; each keeps the whole list of vertices.
std::vector<SurfaceMesh> bodiesOf(const SurfaceMesh& mesh) {
  std::vector<std::uint32_t> parent(mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0U);
  for (const Triangle& triangle : mesh.triangles) {
    for (std::size_t side = 1; side < 3; ++side)
      parent[rootOf(parent, triangle[side])] = rootOf(parent, triangle[0]);
  }
  std::map<std::uint32_t, std::vector<Triangle>> parts;
  for (const Triangle& triangle : mesh.triangles)
    parts[rootOf(parent, triangle[0])].push_back(triangle);
  std::vector<SurfaceMesh> bodies;
  bodies.reserve(parts.size());
  for (auto& [root, triangles] : parts)
    bodies.push_back({mesh.vertices, std::move(triangles)});
  return bodies;
}

void turnRound(SurfaceMesh& mesh) {
  for (Triangle& triangle : mesh.triangles)
    std::swap(triangle[1], triangle[2]);
}

bool inside(const Vec3& point, const SurfaceMesh& mesh) {
  double solidAngle = 0.0;
  for (const Triangle& triangle : mesh.triangles) {
    const SourcePanel panel(cornersOf(mesh, triangle));
    solidAngle += panel.fieldAt(point).gradient.dot(panel.normal());
  }
  return solidAngle > 2.0 * std::numbers::pi;
}

bool insideAnother(const std::vector<SurfaceMesh>& bodies, std::size_t body) {
  const auto [a, b, c] = cornersOf(bodies[body], bodies[body].triangles.front());
  const Vec3 point = (a + b + c) / 3.0;
  for (std::size_t other = 0; other < bodies.size(); ++other) {
    if (other != body && inside(point, bodies[other])) return true;
  }
  return false;
}

void dropWithoutArea(SurfaceMesh& mesh, double extent) {
  std::erase_if(mesh.triangles, [&](const Triangle& triangle) {
    return twiceAreaOf(mesh, triangle).norm() <= kNoArea * extent * extent;
  });
}

SurfaceMesh outsideOf(const SurfaceMesh& mesh, double extent) {
  std::vector<SurfaceMesh> bodies = bodiesOf(mesh);
  for (SurfaceMesh& body : bodies) {
    if (signedVolume(body) < 0.0) turnRound(body);
    dropWithoutArea(body, extent);
  }
  std::erase_if(bodies, [](const SurfaceMesh& body) { return body.triangles.empty(); });
  SurfaceMesh result{mesh.vertices, {}};
  for (std::size_t body = 0; body < bodies.size(); ++body) {
    if (bodies.size() > 1 && insideAnother(bodies, body)) continue;
    const auto& triangles = bodies[body].triangles;
    result.triangles.insert(result.triangles.end(), triangles.begin(), triangles.end());
  }
  return result;
}

// The planes of the triangles around a cell: the sum over them of (n . x - d)^2, by area.
struct Quadric {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  Vec3 vector = Vec3::Zero();
  Vec3 sum = Vec3::Zero();
  double weight = 0.0;

  void add(const Vec3& normal, const Vec3& corner, double area) {
    matrix += area * normal * normal.transpose();
    vector += area * normal.dot(corner) * normal;
    sum += area * corner;
    weight += area;
  }

  // Returns the point that fits the planes best; along directions that they leave free, and if that
  // point is a cell away or more, the mean of the vertices.
  Vec3 best(double cell) const {
    const Vec3 mean = sum / weight;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(matrix);
    const Vec3 rest = vector - matrix * mean;
    Vec3 point = mean;
    for (Eigen::Index k = 0; k < 3; ++k) {
      if (eigen.eigenvalues()[k] < kFlatQuadric * eigen.eigenvalues()[2]) continue;
      const Vec3 axis = eigen.eigenvectors().col(k);
      point += axis.dot(rest) / eigen.eigenvalues()[k] * axis;
    }
    return (point - mean).norm() < cell ? point : mean;
  }
};

// Returns which of six ways a normal faces, so that opposite sides of a thin body are never merged.
std::int64_t facing(const Vec3& normal) {
  Eigen::Index axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  return 2 * axis + (normal[axis] > 0.0 ? 1 : 0);
}

std::vector<Vec3> vertexNormals(const SurfaceMesh& mesh) {
  std::vector<Vec3> normals(mesh.vertices.size(), Vec3::Zero());
  for (const Triangle& triangle : mesh.triangles) {
    for (const std::uint32_t corner : triangle)
      normals[corner] += twiceAreaOf(mesh, triangle);
  }
  return normals;
}

SurfaceMesh clustered(const SurfaceMesh& mesh, double cell) {
  const std::vector<Vec3> normals = vertexNormals(mesh);
  std::map<std::array<std::int64_t, 4>, std::uint32_t> cells;
  std::vector<std::uint32_t> name(mesh.vertices.size(), 0);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    std::array<std::int64_t, 4> place{};
    for (std::size_t axis = 0; axis < 3; ++axis)
      place[axis] = std::llround(mesh.vertices[v][static_cast<Eigen::Index>(axis)] / cell);
    place[3] = facing(normals[v]);
    name[v] = cells.try_emplace(place, index(cells.size())).first->second;
  }
  std::vector<Quadric> quadrics(cells.size());
  for (const Triangle& triangle : mesh.triangles) {
    const Vec3 twice = twiceAreaOf(mesh, triangle);
    for (const std::uint32_t corner : triangle)
      quadrics[name[corner]].add(twice.normalized(), mesh.vertices[corner], twice.norm());
  }
  SurfaceMesh result;
  for (const Quadric& quadric : quadrics)
    result.vertices.push_back(quadric.weight > 0.0 ? quadric.best(cell) : Vec3::Zero());
  result.triangles = renamed(mesh.triangles, name);
  return result;
}

// Returns an empty mesh if there is none of so few triangles.
SurfaceMesh clusteredDownTo(const SurfaceMesh& mesh, std::size_t most) {
  double cell = std::sqrt(surfaceArea(mesh) / static_cast<double>(most));
  SurfaceMesh result = clustered(mesh, cell);
  // Cells as large as the whole leave what faces six ways: of many bodies apart, each a few
  // triangles for ever.
  const double widest = 4.0 * extentOf(mesh);
  while (result.triangles.size() > most && cell < widest) {
    cell *= 1.1;
    result = clustered(mesh, cell);
  }
  if (result.triangles.size() > most) return {};
  if (!result.triangles.empty()) dropWithoutArea(result, extentOf(result));
  return result;
}

double longestSquared(const std::array<Vec3, 3>& corners, std::size_t& side) {
  double longest = -1.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double length = (corners[(k + 1) % 3] - corners[k]).squaredNorm();
    if (length > longest) {
      longest = length;
      side = k;
    }
  }
  return longest;
}

// Halves the triangles whose longest edge is at least `threshold` squared.
SurfaceMesh halvedOnce(SurfaceMesh mesh, double threshold) {
  const std::size_t count = mesh.triangles.size();
  for (std::size_t t = 0; t < count; ++t) {
    const Triangle triangle = mesh.triangles[t];
    const std::array<Vec3, 3> corners = cornersOf(mesh, triangle);
    std::size_t side = 0;
    if (longestSquared(corners, side) < threshold) continue;
    const std::uint32_t middle = index(mesh.vertices.size());
    mesh.vertices.push_back(0.5 * (corners[side] + corners[(side + 1) % 3]));
    const std::uint32_t opposite = triangle[(side + 2) % 3];
    mesh.triangles[t] = {triangle[side], middle, opposite};
    mesh.triangles.push_back({middle, triangle[(side + 1) % 3], opposite});
  }
  return mesh;
}

}  // namespace

Result<SurfaceMesh> cleanSurface(const SurfaceMesh& mesh) {
  const Status numbers = checkNumbers(mesh);
  if (!numbers) return numbers.error();
  const double extent = extentOf(mesh);
  SurfaceMesh welded{mesh.vertices, {}};
  welded.triangles = renamed(mesh.triangles, coincident(mesh.vertices, kWeld * extent));
  if (const std::size_t open = openEdges(welded); open > 0) {
    return Error{"surface: it is open at " + std::to_string(open) +
                 " edges, or neighbours face opposite ways; expected a closed mesh"};
  }
  SurfaceMesh clean = outsideOf(welded, extent);
  if (clean.triangles.empty() || !(signedVolume(clean) > kNoVolume * extent * extent * extent)) {
    return Error{"surface: it encloses no volume; expected a solid body, not a sheet"};
  }
  return clean;
}

bool isFolded(const SurfaceMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, Vec3> sides;
  for (const Triangle& triangle : mesh.triangles)
    for (std::size_t side = 0; side < 3; ++side)
      sides[{triangle[side], triangle[(side + 1) % 3]}] = twiceAreaOf(mesh, triangle).normalized();
  return std::ranges::any_of(sides, [&](const auto& one) {
    const auto other = sides.find({one.first.second, one.first.first});
    return other != sides.end() && other->second.dot(one.second) < kBackToBack;
  });
}

SurfaceMesh clusteredSurface(const SurfaceMesh& mesh, std::size_t most) {
  if (mesh.triangles.size() <= most) return mesh;
  SurfaceMesh clusters = clusteredDownTo(mesh, most);
  const double volume = signedVolume(mesh);
  const double lost = std::abs(signedVolume(clusters) - volume);
  if (lost <= kMostLost * volume && !isFolded(clusters)) return clusters;
  const double extent = extentOf(mesh);
  for (const double deviation : kDeviations) {
    SurfaceMesh collapsed = collapsedSurface(mesh, most, deviation * extent);
    if (collapsed.triangles.size() <= most) return collapsed;
  }
  return clusters;
}

SurfaceMesh halvedSurface(SurfaceMesh mesh, std::size_t least) {
  while (!mesh.triangles.empty() && mesh.triangles.size() < least) {
    double longest = 0.0;
    std::size_t side = 0;
    for (const Triangle& triangle : mesh.triangles)
      longest = std::max(longest, longestSquared(cornersOf(mesh, triangle), side));
    mesh = halvedOnce(std::move(mesh), 0.95 * longest);
  }
  return mesh;
}

SurfaceMesh quarteredSurface(const SurfaceMesh& mesh) {
  SurfaceMesh result{mesh.vertices, {}};
  for (const Triangle& triangle : mesh.triangles) {
    const auto [a, b, c] = cornersOf(mesh, triangle);
    const std::uint32_t ab = index(result.vertices.size());
    const std::uint32_t bc = ab + 1;
    const std::uint32_t ca = ab + 2;
    result.vertices.insert(result.vertices.end(), {0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)});
    result.triangles.insert(
        result.triangles.end(),
        {{triangle[0], ab, ca}, {triangle[1], bc, ab}, {triangle[2], ca, bc}, {ab, bc, ca}});
  }
  return result;
}

double sharpEdgeLength(const SurfaceMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, Vec3> open;  // first triangle's normal
  double length = 0.0;
  for (const Triangle& triangle : mesh.triangles) {
    const Vec3 normal = twiceAreaOf(mesh, triangle).normalized();
    for (std::size_t side = 0; side < 3; ++side) {
      const auto [from, to] = std::pair(triangle[side], triangle[(side + 1) % 3]);
      const auto [found, fresh] = open.try_emplace(std::minmax(from, to), normal);
      if (fresh) continue;
      if (found->second.dot(normal) < std::numbers::sqrt2 / 2.0)
        length += (mesh.vertices[to] - mesh.vertices[from]).norm();
    }
  }
  return length;
}

}  // namespace carom::audio
