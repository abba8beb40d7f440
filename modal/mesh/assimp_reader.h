#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "carom/audio/result.h"
#include "modal/mesh/polygon_mesh.h"

namespace carom::modal {

/// Returns the polygons of an OBJ, STL or glTF 2 file as Assimp finds them, all meshes where their
/// nodes place them; a mesh that a node mirrors is turned, so that its outside stays outside.
/// @param extension ".obj", ".stl", ".gltf" or ".glb": nothing else is tried
/// @param folder of the other files that a .gltf names; only files in or below it are opened, and
///   none if it is absent
/// Errors, without the name of the file: the message of Assimp. In a build without Assimp: always.
/// [any thread but the audio thread]
Result<PolygonMesh> readByAssimp(std::span<const std::byte> bytes, const std::string& extension,
                                 const std::optional<std::filesystem::path>& folder);

}  // namespace carom::modal
