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

/// How the numbers of a mesh file are taken.
struct MeshImport {
  double scale = 1.0;  ///< m, what one unit of the file is: 0.001 for a file in millimetres
  /// Vertices nearer to each other than this share of the largest extent become one: files repeat
  /// a vertex for each of its triangles. From 0 (only those that are equal) to 0.1.
  double weldTolerance = 1e-6;
};

/// What was in a mesh file.
struct LoadedMesh {
  SurfaceMesh surface;  ///< m, all meshes in one, in the frame of the file
  /// Of the first picture on it, by triangle of `surface`, u to the right and v up; empty, unless
  /// all of its meshes have them. Nothing is checked of them.
  std::vector<TextureCoordinates::Corners> coordinates;
  std::size_t meshes = 0;    ///< how many went into it, each as often as the file places it
  std::size_t vanished = 0;  ///< triangles whose corners were one within the tolerance
  std::size_t leftOut = 0;   ///< points and lines, which have no surface
};

/// The meshes of an OBJ, PLY (text or binary), STL (text or binary) or glTF 2 file (.gltf, .glb),
/// each where its nodes place it; polygons in triangles, with the texture coordinates of the first
/// picture; materials and all else left aside. What
/// the extension says is what the file has to be. glTF is in metres, the others in whatever their
/// author thought of: nothing is converted but by `import.scale`. Nothing is checked of the shape:
/// checkMesh does that.
///
/// Assimp takes all but PLY apart, in single precision; what comes out of it is checked here. It
/// leaves out triangles of a glTF whose indices are out of range, which opens the surface. A .gltf
/// may name files beside or below it, nothing else is opened. Errors, each one sentence with the
/// name of the file: it is missing, a folder or larger than 1 GiB; another extension; what its
/// reader refuses; no triangles, or more than 10 million; polygons of more than 4096 corners;
/// indices out of range; coordinates that are not finite. In a build without Assimp: all but PLY.
/// [any thread but the audio thread]
Result<LoadedMesh> loadMesh(const std::filesystem::path& path, const MeshImport& import = {});

/// The same for the bytes of a file, of which `name` is what messages call it, and its extension
/// the format. Names of other files in it are an error. [any thread but the audio thread]
Result<LoadedMesh> meshFromBytes(std::span<const std::byte> bytes, const std::string& name,
                                 const MeshImport& import = {});

}  // namespace carom
