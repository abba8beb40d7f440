#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "carom/audio/material.h"
#include "carom/audio/result.h"
#include "carom/native/restitution.h"
#include "modal/json/json_reader.h"
#include "scenes/format/scene.h"
#include "scenes/format/scene_folder.h"

namespace carom::scenes {

// The parts of a scene document that say what bodies are made of: "materials", "restitutions", and
// the "material" of a body. Every error is recorded at its node, and what was read is then dropped
// with the scene. docs/scenes.md has the fields.

/// The properties of a body's surface: its material, and what the scene adds to it.
struct SurfaceMaterial {
  Material material;
  SurfaceId surface = 0;  ///< index of the material in the restitutions; 0: none there
  ContactTraits contact = {};
  std::optional<NormalMapFile> normalMap = std::nullopt;
  std::string builtIn = {};  ///< name of the built-in material that it is or is like, if any

  /// Makes a body that has no shape yet.
  SceneBody body(std::string name) &&;
};

/// Reads the materials of one scene: first those of its own, which may be like others, then the
/// restitutions of pairs, then the materials of its bodies, which refer to both. [one thread]
class MaterialReader {
 public:
  /// Names of normal maps are relative to `folder`.
  explicit MaterialReader(SceneFolder folder) : folder_(std::move(folder)) {}

  /// Reads "materials", the scene's own ones.
  void readMaterials(const modal::JsonNode& materials);

  /// Reads "restitutions" into `table`.
  void readRestitutions(const modal::JsonNode& restitutions, RestitutionTable& table);

  /// Reads the "material" of a body, with the roughness and the normal map of the body itself. One
  /// that is given as an object is called `name`.
  SurfaceMaterial readBodyMaterial(const modal::JsonNode& entry, const std::string& name) const;

  /// Reads the "material" of a group of spheres: one, or several to choose from. Those that are
  /// given as objects are called after the group's `name`.
  std::vector<SurfaceMaterial> readGroupMaterials(const modal::JsonNode& entry,
                                                  const std::string& name) const;

 private:
  friend Result<Material> loadMaterial(const std::filesystem::path& file);

  SurfaceMaterial readMaterialObject(const modal::JsonNode& node, std::string name) const;
  void readOwnMaterial(const std::string& name);
  bool checkEnds(const modal::JsonNode& like, const std::string& base) const;
  SurfaceMaterial readMaterial(const modal::JsonNode& node, const std::string& inlineName) const;
  SurfaceMaterial namedMaterial(const modal::JsonNode& node, const std::string& otherwise) const;
  std::vector<std::string_view> knownMaterials() const;
  bool checkKnown(const modal::JsonNode& node, const std::string& name,
                  const std::string& otherwise) const;
  void readRestitution(const modal::JsonNode& entry, RestitutionTable& table);
  SurfaceId assignSurface(const std::string& material);
  SurfaceId findSurface(const modal::JsonNode& material) const;

  SceneFolder folder_;
  std::map<std::string, modal::JsonNode, std::less<>> ownNodes_;
  std::map<std::string, SurfaceMaterial, std::less<>> ownMaterials_;  // their `surface` is not set
  std::vector<std::string> chain_;  // own materials being read, each of which is like the next
  std::map<std::string, SurfaceId, std::less<>> surfaces_;  // of the materials in "restitutions"
};

/// Reads a file that holds one material: an object as in "materials" of a scene, which may be like
/// a built-in one. It is called as the file without its extension. [any thread]
Result<Material> loadMaterial(const std::filesystem::path& file);

}  // namespace carom::scenes
