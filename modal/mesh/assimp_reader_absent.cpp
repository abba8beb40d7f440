// Takes the place of assimp_reader.cpp in a build without Assimp.

#include "modal/mesh/assimp_reader.h"

namespace carom::modal {

Result<PolygonMesh> readByAssimp(std::span<const std::byte>, const std::string& extension) {
  return Error{"this build of Carom reads no " + extension +
               "; build it with CAROM_MESHES=ON, or give it a .ply or a .glb"};
}

}  // namespace carom::modal
