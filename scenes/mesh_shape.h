#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "carom/audio/result.h"
#include "carom/modal/mesh_file.h"
#include "scenes/solid_shape.h"

namespace carom::scenes {

/// Reads a mesh, in units of `scale` metres. An error names the file, what is wrong with it and
/// what would be accepted. Corners that more than one triangle has are one vertex. [any thread]
Result<LoadedMesh> meshOf(const std::filesystem::path& file, double scale);

/// Why a mesh cannot be that of a body; empty where it can. One that moves has to have a volume:
/// closed, and outward. [any thread]
std::string whyNot(const SurfaceMesh& surface, bool canMove);

/// The vertices of each part: of what is joined by edges of two triangles, so that parts may touch.
/// In the order of their first vertex's coordinates. [any thread]
std::vector<std::vector<Vec3>> connectedParts(const SurfaceMesh& surface);

/// The meshes of one scene: each is read once. [one thread]
class MeshShelf {
 public:
  /// What a body's mesh is made of. Names of files as they can be opened.
  struct Request {
    std::filesystem::path file;
    std::filesystem::path pieces;  ///< empty: collides as its hull
    double scale = 1.0;            ///< m, of one unit of both files

    // NOLINTNEXTLINE(modernize-use-nullptr): it takes the 0 of the default one for a pointer
    auto operator<=>(const Request&) const = default;
  };

  Result<std::shared_ptr<const SolidMesh>> get(const Request& request);

 private:
  std::map<Request, std::shared_ptr<const SolidMesh>> meshes_;
};

}  // namespace carom::scenes
