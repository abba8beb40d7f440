#include "scenes/format/mesh_shape.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <locale>
#include <numeric>
#include <set>
#include <sstream>
#include <string>
#include <utility>

#include <Eigen/Dense>

#include "audio/io/byte_file.h"

namespace carom::scenes {
namespace {

constexpr double kSmallest = 1e-6;  // m, extent: as the least radius of a sphere
constexpr double kLargest = 2e4;    // m, extent
constexpr double kFlat = 1e-6;      // least thickness of a piece as a share of its longest extent

std::string number(double value) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << value;
  return text.str();
}

Status validateFile(const std::filesystem::path& file) {
  if (!audio::isRegularFile(file))
    return Error{"there is no file \"" + file.string() +
                 "\"; expected a mesh, its name relative to the scene's folder"};
  return std::monostate{};
}

Vec3 extentOf(const std::vector<Vec3>& points) {
  Vec3 low = points.front();
  Vec3 high = low;
  for (const Vec3& point : points) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  return high - low;
}

/// True if the hull of these points would enclose no volume, in whatever direction they lie.
bool isFlat(const std::vector<Vec3>& points) {
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Vec3& point : points)
    spread += (point - points.front()) * (point - points.front()).transpose();
  const Vec3 squares = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvalues();
  return !(squares[0] > kFlat * kFlat * squares[2]);
}

std::size_t rootOf(std::size_t triangle, std::vector<std::size_t>& parents) {
  while (parents[triangle] != triangle)
    triangle = parents[triangle] = parents[parents[triangle]];
  return triangle;
}

Result<std::vector<std::vector<Vec3>>> piecesOf(const std::filesystem::path& file, double scale) {
  const Result<LoadedMesh> mesh = meshOf(file, scale);
  if (!mesh) return mesh.error();
  if (const Status valid = validate(mesh->surface, false); !valid)
    return Error{file.string() + ": " + valid.error().message};
  std::vector<std::vector<Vec3>> pieces = connectedParts(mesh->surface);
  for (std::size_t piece = 0; piece < pieces.size(); ++piece) {
    if (isFlat(pieces[piece]))
      return Error{file.string() + ": part " + std::to_string(piece + 1) + " of " +
                   std::to_string(pieces.size()) + " is flat; expected solid convex pieces"};
  }
  return pieces;
}

}  // namespace

Result<LoadedMesh> meshOf(const std::filesystem::path& file, double scale) {
  if (const Status valid = validateFile(file); !valid) return Error{valid.error().message};
  return loadMesh(file, {.scale = scale});
}

Status validate(const SurfaceMesh& surface, bool canMove) {
  if (surface.triangles.empty()) return Error{"has no triangles; expected a mesh of triangles"};
  const Vec3 extent = extentOf(surface.vertices);
  if (!extent.allFinite()) return Error{"has a vertex that is not finite; expected numbers"};
  const double across = extent.maxCoeff();
  if (!(across >= kSmallest && across <= kLargest))
    return Error{"is " + number(across) + " m across; expected " + number(kSmallest) + " to " +
                 number(kLargest) + " m, or another \"scale\""};
  if (!canMove) return std::monostate{};
  if (!closedSurface(surface))
    return Error{
        "is open: the surface of a body that moves encloses it; expected each edge between two "
        "triangles, or \"movable\": false"};
  const double volume = signedVolume(surface);
  if (volume > kFlat * kFlat * across * across * across) return std::monostate{};
  return Error{volume < 0.0
                   ? "is inside out; expected triangles that are counterclockwise as seen from "
                     "outside"
                   : "encloses no volume; expected a solid body, or \"movable\": false"};
}

std::vector<std::vector<Vec3>> connectedParts(const SurfaceMesh& surface) {
  // An edge where parts touch may have four triangles: it joins none of them.
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::size_t>> trianglesAt;
  for (std::size_t index = 0; index < surface.triangles.size(); ++index) {
    const auto& [a, b, c] = surface.triangles[index];
    for (const auto& edge : {std::minmax(a, b), std::minmax(b, c), std::minmax(c, a)})
      trianglesAt[edge].push_back(index);
  }
  std::vector<std::size_t> parents(surface.triangles.size());
  std::iota(parents.begin(), parents.end(), std::size_t{0});
  for (const auto& [edge, triangles] : trianglesAt)
    if (triangles.size() == 2)
      parents[rootOf(triangles[0], parents)] = rootOf(triangles[1], parents);
  std::map<std::size_t, std::set<std::uint32_t>> verticesOf;  // by root
  for (std::size_t index = 0; index < parents.size(); ++index) {
    const auto& corners = surface.triangles[index];
    verticesOf[rootOf(index, parents)].insert(corners.begin(), corners.end());
  }
  std::vector<std::vector<Vec3>> parts;
  for (const auto& [root, vertices] : verticesOf) {
    std::vector<Vec3>& part = parts.emplace_back();
    for (const std::uint32_t vertex : vertices)
      part.push_back(surface.vertices[vertex]);
  }
  std::ranges::sort(parts, [](const auto& one, const auto& other) {
    return std::lexicographical_compare(one.front().begin(), one.front().end(),
                                        other.front().begin(), other.front().end());
  });
  return parts;
}

Result<std::shared_ptr<const SolidMesh>> MeshShelf::get(const Request& request) {
  std::shared_ptr<const SolidMesh>& place = meshes_[request];
  if (place != nullptr) return place;
  SolidMesh mesh;
  Result<LoadedMesh> loaded = meshOf(request.file, request.scale);
  if (!loaded) return loaded.error();
  mesh.surface = std::move(loaded->surface);
  mesh.coordinates = std::move(loaded->coordinates);
  if (request.pieces.empty()) {
    mesh.pieces = {mesh.surface.vertices};  // all are used, since the mesh has been welded
  } else {
    auto pieces = piecesOf(request.pieces, request.scale);
    if (!pieces) return pieces.error();
    mesh.pieces = *std::move(pieces);
  }
  place = std::make_shared<const SolidMesh>(std::move(mesh));
  return place;
}

}  // namespace carom::scenes
