#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <carom/audio/result.h>
#include <carom/audio/surface_mesh.h>
#include <carom/audio/texture_coordinates.h>

namespace carom {

/// The interpretation of the numbers of a mesh file.
struct MeshImport {
  double scale = 1.0;  ///< length of one unit of the file, m: 0.001 for millimetres
  /// Vertices nearer to each other than this share of the largest extent become one: files repeat
  /// a vertex for each of its triangles. From 0 (only those that are equal) to 0.1.
  double weldTolerance = 1e-6;
};

/// The content of a mesh file.
struct LoadedMesh {
  SurfaceMesh surface;  ///< m, all meshes in one, in the frame of the file
  /// Texture coordinates in the first picture, by triangle of `surface`, u to the right and v up;
  /// empty, unless all meshes have them. They are not checked.
  std::vector<TextureCoordinates::Corners> coordinates;
  std::size_t meshes = 0;    ///< number of meshes in it, each as often as the file places it
  std::size_t vanished = 0;  ///< triangles whose corners were one within the tolerance
  std::size_t leftOut = 0;   ///< points and lines, which have no surface
};

/// Loads the meshes of an OBJ, PLY (text or binary), STL (text or binary) or glTF 2 file (.gltf,
/// .glb), each where its nodes place it; polygons are cut into triangles, with the texture
/// coordinates of the first picture; materials and all else are left aside. The file has to be of
/// the format that its extension says. glTF is in metres, the other formats in any unit of their
/// author: only `import.scale` converts. The shape is not checked: checkMesh does that.
///
/// Assimp parses OBJ and STL, in single precision; its results are checked here. A .gltf may name
/// files beside or below it, nothing else is opened. Errors, each one sentence with the name
/// of the file: it is missing, a folder or larger than 1 GiB; another extension; a file that its
/// reader refuses; no triangles, or more than 10 million; polygons of more than 4096 corners;
/// indices out of range; coordinates that are not finite. In a build without Assimp: OBJ and STL.
/// [any thread but the audio thread]
Result<LoadedMesh> loadMesh(const std::filesystem::path& path, const MeshImport& import = {});

/// Loads the same from the bytes of a file, which messages call `name`; its extension is the
/// format. Names of other files in it are an error. [any thread but the audio thread]
Result<LoadedMesh> meshFromBytes(std::span<const std::byte> bytes, const std::string& name,
                                 const MeshImport& import = {});

}  // namespace carom
