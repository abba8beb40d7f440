#pragma once

#include <filesystem>

#include "modal/json/json_reader.h"
#include "scenes/format/mesh_shape.h"
#include "scenes/format/scene_folder.h"
#include "scenes/format/solid_shape.h"

namespace carom::scenes {

// The part of a scene document that says what a body of type "solid" is. Every error is recorded at
// its node, and what was read is then dropped with the scene. docs/scenes.md has the fields.

/// Reads solids. Names of files are relative to the scene's folder; each mesh is read once.
/// [one thread]
class SolidReader {
 public:
  explicit SolidReader(SceneFolder folder) : folder_(std::move(folder)) {}

  /// True if `entry` is an object with no key but a solid's.
  static bool expectSolid(const modal::JsonNode& entry);

  /// Reads a solid, all but its name and material; `density` in kg/m^3.
  SolidShape read(const modal::JsonNode& entry, double density);

 private:
  void readShape(const modal::JsonNode& node, bool canMove, SolidShape& solid);
  void readMesh(const modal::JsonNode& node, bool canMove, SolidShape& solid);

  SceneFolder folder_;
  MeshShelf meshes_;
};

}  // namespace carom::scenes
