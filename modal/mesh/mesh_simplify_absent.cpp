// Takes the place of mesh_simplify.cpp in a build without meshoptimizer.

#include <string>

#include "modal/mesh/mesh_detail.h"

namespace carom::modal {

Result<SurfaceMesh> simplified(const SurfaceMesh& mesh, std::size_t most) {
  if (mesh.vertices.size() <= most) return mesh;
  return Error{"simplification: this build of Carom has none, and the mesh has " +
               std::to_string(mesh.vertices.size()) +
               " vertices; build it with CAROM_MESHES=ON, or allow as many"};
}

}  // namespace carom::modal
