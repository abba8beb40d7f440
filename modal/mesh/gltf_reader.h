#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>

#include "carom/audio/result.h"
#include "modal/mesh/polygon_mesh.h"

namespace carom::modal {

/// Returns the triangles of a glTF 2.0 file, text or GLB (Khronos, glTF 2.0 specification, 3.5 and
/// 3.7): triangles, strips and fans of all meshes of its scene, where its nodes place them; a mesh
/// that a node mirrors is turned, so that its outside stays outside. Meshes are as they rest,
/// without skins and morph targets. Points and lines are left out, and materials not looked at.
/// @param folder of the other files that a .gltf names; only files in or below it are opened, and
///   none if it is absent
/// Errors, without the name of the file: places are JSON pointers. Numbers that contradict each
/// other, indices beyond their vertices, nodes that are no tree, sparse or compressed accessors.
/// Assimp is not used, since its version 5.2.5 reads beyond the ends of buffers that are smaller
/// than their accessors state. [any thread but the audio thread]
Result<PolygonMesh> readGltf(std::span<const std::byte> bytes,
                             const std::optional<std::filesystem::path>& folder);

}  // namespace carom::modal
