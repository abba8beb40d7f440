#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "carom/audio/result.h"
#include "modal/mesh/polygon_mesh.h"

namespace carom::modal {

/// Returns the polygons of an OBJ or STL file as Assimp finds them, all its meshes.
/// @param extension ".obj" or ".stl": nothing else is tried, and no other file is opened
/// Errors, without the name of the file: the message of Assimp. In a build without Assimp: always.
/// [any thread but the audio thread]
Result<PolygonMesh> readByAssimp(std::span<const std::byte> bytes, const std::string& extension);

}  // namespace carom::modal
