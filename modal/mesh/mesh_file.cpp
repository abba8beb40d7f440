#include "carom/modal/mesh_file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "audio/io/byte_file.h"
#include "audio/model/positive.h"
#include "modal/mesh/assimp_reader.h"
#include "modal/mesh/gltf_reader.h"
#include "modal/mesh/ply_reader.h"
#include "modal/mesh/polygon_mesh.h"
#include "modal/mesh/printable.h"

namespace carom {

using namespace audio;
using namespace modal;

namespace {

namespace fs = std::filesystem;

constexpr double kMaxWeld = 0.1;

constexpr std::array<std::string_view, 5> kMeshExtensions = {".obj", ".ply", ".stl", ".gltf",
                                                             ".glb"};

Status validate(const MeshImport& import) {
  if (!isPositive(import.scale))
    return Error{"the scale must be positive (m to a unit of the file)"};
  if (!(import.weldTolerance >= 0.0 && import.weldTolerance <= kMaxWeld))
    return Error{"the weld tolerance must be from 0 to 0.1 (of the extent)"};
  return std::monostate{};
}

/// Returns the extension in lower case; empty if it is none that can be read.
std::string formatOf(const fs::path& name) {
  std::string extension = name.extension().string();
  for (char& letter : extension)
    letter = static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
  return std::ranges::find(kMeshExtensions, extension) != kMeshExtensions.end() ? extension : "";
}

double extentOfPoints(const std::vector<Vec3>& points) {
  if (points.empty()) return 0.0;
  Vec3 low = points.front();
  Vec3 high = low;
  for (const Vec3& point : points) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  return (high - low).maxCoeff();
}

/// Largest coordinate of a vertex, m.
constexpr double kFarthest = 1e9;

Status validate(const PolygonMesh& mesh) {
  std::size_t triangles = 0;
  for (std::size_t index = 0; index < mesh.polygons(); ++index) {
    const auto polygon = mesh.polygon(index);
    for (const std::uint32_t vertex : polygon)
      if (vertex >= mesh.vertices.size())
        return Error{"polygon " + std::to_string(index) + " names vertex " +
                     std::to_string(vertex) + " of " + std::to_string(mesh.vertices.size())};
    if (polygon.size() > kMostCorners)
      return Error{"polygon " + std::to_string(index) + " has " + std::to_string(polygon.size()) +
                   " corners; expected at most " + std::to_string(kMostCorners)};
    triangles += polygon.size() < 3 ? 0 : polygon.size() - 2;
  }
  if (triangles > kMaxTriangles)
    return Error{"it has " + std::to_string(triangles) + " triangles; expected at most 10 million"};
  return std::monostate{};
}

Result<LoadedMesh> surfaceOf(const PolygonMesh& mesh, const MeshImport& import) {
  if (const Status valid = validate(mesh); !valid) return Error{valid.error().message};
  LoadedMesh result;
  result.meshes = mesh.meshes;
  result.leftOut = mesh.leftOut;
  SurfaceMesh loose;
  for (const Vec3& vertex : mesh.vertices) {
    loose.vertices.emplace_back(import.scale * vertex);
    // The largest of numbers of which one is no number may be any other.
    if (!loose.vertices.back().allFinite() ||
        loose.vertices.back().cwiseAbs().maxCoeff() > kFarthest)
      return Error{
          "vertex " + std::to_string(loose.vertices.size() - 1) +
          " is not finite or too far away; expected coordinates from -1e9 to 1e9 (metres)"};
  }
  PolygonCutter cutter(loose.vertices);
  for (std::size_t index = 0; index < mesh.polygons(); ++index)
    cutter.cut(mesh.polygon(index), loose.triangles);
  std::vector<std::uint32_t> kept;
  result.surface = welded(loose, import.weldTolerance * extentOfPoints(loose.vertices), &kept);
  // Texture coordinates come from the vertices before welding: along a seam one place has two.
  if (!mesh.coordinates.empty()) {
    for (const std::uint32_t index : kept) {
      const auto& [a, b, c] = loose.triangles[index];
      result.coordinates.push_back({mesh.coordinates[a], mesh.coordinates[b], mesh.coordinates[c]});
    }
  }
  result.vanished = loose.triangles.size() - result.surface.triangles.size();
  if (result.surface.triangles.empty()) return Error{"it has no triangles; expected a surface"};
  return result;
}

Result<PolygonMesh> readPolygons(std::span<const std::byte> bytes, const std::string& format,
                                 const std::optional<fs::path>& folder) {
  if (format == ".ply") return readPly(bytes);
  if (format == ".gltf" || format == ".glb") return readGltf(bytes, folder);
  return readByAssimp(bytes, format);
}

Result<LoadedMesh> read(std::span<const std::byte> bytes, const fs::path& name,
                        const std::optional<fs::path>& folder, const MeshImport& import) {
  if (const Status valid = validate(import); !valid) return Error{valid.error().message};
  const std::string format = formatOf(name);
  if (format.empty())
    return Error{"its name ends in '" + printable(name.extension().string()) +
                 "'; expected .obj, .ply, .stl, .gltf or .glb"};
  if (bytes.empty()) return Error{"it is empty"};
  const Result<PolygonMesh> mesh = readPolygons(bytes, format, folder);
  if (!mesh) return mesh.error();
  return surfaceOf(*mesh, import);
}

/// Names the file, and what would be accepted where the reader of its format does not.
Error refused(const fs::path& name, const Error& error) {
  const bool isTold = error.message.find("expected ") != std::string::npos;
  return Error{"mesh file '" + name.string() + "': " + error.message +
               (isTold ? "" : "; expected a whole OBJ, PLY, STL or glTF file with triangles")};
}

}  // namespace

Result<LoadedMesh> loadMesh(const fs::path& path, const MeshImport& import) {
  const Result<std::vector<std::byte>> bytes = readBytes(path);
  if (!bytes) return refused(path, bytes.error());
  Result<LoadedMesh> result = read(*bytes, path, path.parent_path(), import);
  if (!result) return refused(path, result.error());
  return result;
}

Result<LoadedMesh> meshFromBytes(std::span<const std::byte> bytes, const std::string& name,
                                 const MeshImport& import) {
  Result<LoadedMesh> result = read(bytes, name, std::nullopt, import);
  if (!result) return refused(name, result.error());
  return result;
}

}  // namespace carom
