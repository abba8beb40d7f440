#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "carom/audio/result.h"
#include "carom/modal/mesh_file.h"
#include "scenes/format/solid_shape.h"

namespace carom::scenes {

/// Reads a mesh, in units of `scale` metres. An error names the file, what is wrong with it and
/// what would be accepted. Corners that several triangles share become one vertex. [any thread]
Result<LoadedMesh> meshOf(const std::filesystem::path& file, double scale);

/// Refuses a mesh that cannot be that of a body. The mesh of a body that moves
/// must have a volume: it is closed, and its triangles face outward. [any thread]
Status validate(const SurfaceMesh& surface, bool canMove);

/// Returns the vertices of each connected part of a surface, in the order of the parts' first
/// vertices by coordinates. Only an edge of exactly two triangles connects them, so that parts may
/// touch. [any thread]
std::vector<std::vector<Vec3>> connectedParts(const SurfaceMesh& surface);

/// The meshes of one scene: each is read once. [one thread]
class MeshShelf {
 public:
  /// The files of a body's mesh, under names by which they can be opened.
  struct Request {
    std::filesystem::path file;
    std::filesystem::path pieces;  ///< empty: the body collides as its hull
    double scale = 1.0;            ///< m, length of one unit of both files

    // NOLINTNEXTLINE(modernize-use-nullptr): it takes the 0 of the default one for a pointer
    auto operator<=>(const Request&) const = default;
  };

  Result<std::shared_ptr<const SolidMesh>> get(const Request& request);

 private:
  std::map<Request, std::shared_ptr<const SolidMesh>> meshes_;
};

}  // namespace carom::scenes
