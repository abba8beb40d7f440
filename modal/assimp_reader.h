#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "carom/audio/result.h"
#include "modal/polygon_mesh.h"

namespace carom::modal {

/// The polygons of an OBJ, STL or glTF 2 file as Assimp finds them, all meshes where their nodes
/// place them; one that a node mirrors is turned, so that its outside stays outside.
/// @param extension ".obj", ".stl", ".gltf" or ".glb": nothing else is tried
/// @param folder where the other files are that a .gltf names; beside or below, nothing else is
///   opened. Without: none.
/// Errors, without the name of the file: what Assimp says. In a build without Assimp: always.
/// [any thread but the audio thread]
Result<PolygonMesh> readByAssimp(std::span<const std::byte> bytes, const std::string& extension,
                                 const std::optional<std::filesystem::path>& folder);

}  // namespace carom::modal
