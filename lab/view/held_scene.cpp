#include "lab/view/held_scene.h"

#include <bit>
#include <cstdint>
#include <map>
#include <utility>

#include <nlohmann/json.hpp>

#include "carom/modal/mesh_file.h"
#include "scenes/format/mesh_shape.h"

namespace carom::lab {

namespace {

using Json = nlohmann::ordered_json;

template <class Number>
void addLittleEndian(std::vector<std::byte>& bytes, Number number) {
  for (std::size_t byte = 0; byte < sizeof number; ++byte)
    bytes.push_back(static_cast<std::byte>(number >> (8 * byte) & 0xFFU));
}

/// Returns the triangles as a PLY file (G. Turk, "The PLY Polygon File Format", 1994).
std::vector<std::byte> plyOf(const SurfaceMesh& mesh) {
  const std::string header =
      "ply\nformat binary_little_endian 1.0\nelement vertex " +
      std::to_string(mesh.vertices.size()) +
      "\nproperty double x\nproperty double y\nproperty double z\nelement face " +
      std::to_string(mesh.triangles.size()) +
      "\nproperty list uchar uint vertex_indices\nend_header\n";
  std::vector<std::byte> bytes;
  for (const char letter : header)
    bytes.push_back(static_cast<std::byte>(letter));
  for (const Vec3& vertex : mesh.vertices)
    for (const double coordinate : vertex)
      addLittleEndian(bytes, std::bit_cast<std::uint64_t>(coordinate));
  for (const auto& triangle : mesh.triangles) {
    bytes.push_back(std::byte{3});
    for (const std::uint32_t vertex : triangle)
      addLittleEndian(bytes, vertex);
  }
  return bytes;
}

/// Puts the meshes of one scene into PLY files, each once.
class MeshKeeper {
 public:
  MeshKeeper(std::filesystem::path folder, std::vector<HeldFile>& files)
      : folder_(std::move(folder)), files_(files) {}

  /// Returns the name under which a mesh is held.
  Result<std::string> hold(const std::string& file, double scale) {
    std::string& name = names_[{file, scale}];
    if (!name.empty()) return name;
    const Result<LoadedMesh> mesh = scenes::meshOf(folder_ / file, scale);
    if (!mesh) return mesh.error();
    name = "mesh-" + std::to_string(files_.size()) + ".ply";
    files_.push_back({name, plyOf(mesh->surface)});
    return name;
  }

 private:
  std::filesystem::path folder_;
  std::vector<HeldFile>& files_;
  std::map<std::pair<std::string, double>, std::string> names_;
};

/// Has the shape of a body be one of held files, if it is a mesh.
Status holdShape(Json& shape, MeshKeeper& meshes) {
  if (!shape.is_object() || shape.value("type", "") != "mesh") return std::monostate{};
  const double scale = shape.value("scale", 1.0);
  for (const char* const key : {"file", "pieces"}) {
    if (!shape.contains(key)) continue;
    const Result<std::string> name = meshes.hold(shape.at(key).get<std::string>(), scale);
    if (!name) return name.error();
    shape[key] = *name;
  }
  shape.erase("scale");
  return std::monostate{};
}

bool isModelFile(const Json& modes) {
  return modes.is_string() || (modes.is_object() && modes.contains("file"));
}

}  // namespace

Result<HeldScene> heldScene(const std::string& text, const std::filesystem::path& sceneFile) {
  Json scene = Json::parse(text, nullptr, false);
  if (!scene.is_object()) return Error{"the scene is no JSON object"};
  HeldScene held;
  MeshKeeper meshes(sceneFile.parent_path(), held.files);
  bool isChanged = false;
  for (Json& body : scene["bodies"]) {
    if (!body.is_object()) continue;
    if (body.contains("shape"))
      if (const Status shape = holdShape(body["shape"], meshes); !shape) return shape.error();
    isChanged = body.erase("normal_map") > 0 || isChanged;
    if (body.contains("modes") && isModelFile(body["modes"])) {
      body.erase("modes");
      isChanged = true;
    }
  }
  if (scene.contains("listeners"))
    for (Json& listener : scene["listeners"])
      isChanged = (listener.is_object() && listener.erase("sofa") > 0) || isChanged;
  held.text = isChanged || !held.files.empty() ? scene.dump() : text;
  return held;
}

}  // namespace carom::lab
