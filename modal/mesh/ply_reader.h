#pragma once

#include <cstddef>
#include <span>

#include "carom/audio/result.h"
#include "modal/mesh/polygon_mesh.h"

namespace carom::modal {

/// Reads a PLY file (G. Turk, "The PLY polygon file format", 1994), text or binary of either byte
/// order: x, y and z of its element `vertex`, and where it has them texture coordinates (u and v, s
/// and t, or texture_u and texture_v), the list `vertex_indices` or `vertex_index` of its element
/// `face`; all else is passed over. Errors, without the name of the file: a header that is not one,
/// data that end too early or are no numbers, indices that are no whole numbers from 0 on. The
/// range of the indices is not checked. Assimp is not used, since its version 5.2.5 hangs or
/// crashes on one in ten slightly damaged PLY files. [any thread]
Result<PolygonMesh> readPly(std::span<const std::byte> bytes);

}  // namespace carom::modal
