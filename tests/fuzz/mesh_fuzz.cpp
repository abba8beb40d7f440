#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string_view>

#include "carom/modal/mesh_check.h"
#include "carom/modal/mesh_file.h"
#include "modal/mesh/mesh_detail.h"

namespace {

using carom::SurfaceMesh;

constexpr std::size_t kManyVertices = 2000;

void require(bool promise) {
  if (!promise) std::abort();
}

void requireSound(const SurfaceMesh& mesh) {
  for (const carom::Vec3& vertex : mesh.vertices)
    require(vertex.allFinite());
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t corner : triangle)
      require(corner < mesh.vertices.size());
}

/// Requires that the preparations of a mesh for modal analysis keep their promises for any sound
/// mesh.
void use(const SurfaceMesh& mesh) {
  const carom::MeshReport report = carom::checkMesh(mesh);
  const bool closed = carom::closedSurface(mesh);
  const bool balanced =
      !report.has(carom::MeshFault::open) && !report.has(carom::MeshFault::inconsistent);
  require(closed == balanced);
  const carom::MendedMesh mended = carom::mended(mesh);
  requireSound(mended.surface);
  if (mended.surface.vertices.size() > kManyVertices || mended.surface.triangles.empty()) return;
  const auto fine = carom::modal::subdividedTo(mended.surface, mended.surface.vertices.size() + 20);
  if (!fine) return;
  requireSound(*fine);
  require(carom::closedSurface(*fine) == carom::closedSurface(mended.surface));
}

/// Makes a mesh: the first byte is the number of vertices, each of three bytes; the rest are
/// corners, one byte each.
SurfaceMesh meshOf(std::span<const std::uint8_t> bytes) {
  SurfaceMesh mesh;
  const std::size_t count = bytes.empty() ? 0 : bytes[0] % 32U;
  bytes = bytes.empty() ? bytes : bytes.subspan(1);
  for (; mesh.vertices.size() < count && bytes.size() >= 3; bytes = bytes.subspan(3))
    mesh.vertices.emplace_back(bytes[0] / 16, bytes[1] / 16, bytes[2] / 16);
  for (; !mesh.vertices.empty() && bytes.size() >= 3; bytes = bytes.subspan(3)) {
    const auto corner = [&](std::size_t index) {
      return static_cast<std::uint32_t>(bytes[index] % mesh.vertices.size());
    };
    mesh.triangles.push_back({corner(0), corner(1), corner(2)});
  }
  return mesh;
}

}  // namespace

/// If the first byte is even, the rest is a PLY file, which must give either a sound surface or an
/// error with its name; if it is odd, a small mesh that may have any fault.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::span bytes(data + 1, size - 1);
  if (data[0] % 2 == 1) {
    const SurfaceMesh mesh = meshOf(bytes);
    if (!mesh.triangles.empty()) use(mesh);
    return 0;
  }
  const auto loaded = carom::meshFromBytes(std::as_bytes(bytes), "fuzz.ply");
  if (loaded) {
    requireSound(loaded->surface);
    use(loaded->surface);
  } else {
    require(std::string_view(loaded.error().message).starts_with("mesh file 'fuzz.ply': "));
  }
  return 0;
}
