#include "modal/mesh/gltf_reader.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "modal/gltf/gltf_document.h"
#include "modal/gltf/gltf_format.h"

namespace carom::modal {
namespace {

using Place = Eigen::Affine3d;

constexpr std::string_view kName = "its glTF";
constexpr std::size_t kMostVisits = 1'000'000;

/// The kinds of primitives, as the numbers of `mode` (3.7.2.1).
enum class PrimitiveMode : std::uint8_t { points, lines, loop, lineStrip, triangles, strip, fan };

/// Reads the meshes of a document into polygons, until something is wrong in it.
class GltfMeshReader {
 public:
  explicit GltfMeshReader(GltfDocument document) : document_(std::move(document)) {}

  Result<PolygonMesh> read() {
    checkExtensions();
    walk();
    if (document_.error()) return document_.error().error();
    if (all_.coordinates.size() != all_.vertices.size()) all_.coordinates.clear();
    return std::move(all_);
  }

 private:
  struct Open {
    JsonNode reference;
    Place parent;
  };

  void checkExtensions() {
    for (const JsonNode& name : document_.root().member("extensionsRequired").elements())
      if (const std::string text = name.text();
          text == "KHR_draco_mesh_compression" || text == "EXT_meshopt_compression")
        name.fail("is not read here; write the file without compression");
  }

  /// Returns the nodes at the top of the scene that is to be shown: the first, if none is named.
  std::vector<JsonNode> roots() {
    const JsonNode scenes = document_.root().member("scenes");
    const std::vector<JsonNode> all = scenes.elements();
    if (all.empty()) scenes.fail("is missing: without a scene nothing is shown");
    if (document_.error()) return {};
    const JsonNode which = document_.root().member("scene");
    const JsonNode scene =
        document_.root().has("scene") ? scenes.element(which, "scene") : all.front();
    return scene.member("nodes").elements();
  }

  /// Goes through the tree of nodes without recursion, as it may be as deep as the file is long.
  void walk() {
    const JsonNode nodes = document_.root().member("nodes");
    isSeen_.assign(nodes.elements().size(), false);
    std::vector<Open> open;
    const auto push = [&open](std::vector<JsonNode> references, const Place& place) {
      std::ranges::reverse(references);  // the first one is next
      for (JsonNode& reference : references)
        open.push_back({std::move(reference), place});
    };
    push(roots(), Place::Identity());
    while (!open.empty() && !document_.error()) {
      const Open next = std::move(open.back());
      open.pop_back();
      const JsonNode node = nodes.element(next.reference, "node");
      if (!takeOnce(next.reference)) return;
      const Place place = next.parent * placeOf(node);
      if (node.has("mesh"))
        addMesh(document_.root().member("meshes").element(node.member("mesh"), "mesh"), place);
      if (node.has("children")) push(node.member("children").elements(), place);
    }
  }
  /// False if a node is reached twice: nodes form trees (3.5.1).
  bool takeOnce(const JsonNode& reference) {
    const std::size_t index = reference.index();
    if (document_.error()) return false;
    if (isSeen_[index]) reference.fail("names a node that is in the tree already");
    isSeen_[index] = true;
    return !document_.error();
  }

  static Place placeOf(const JsonNode& node) {
    Place place = Place::Identity();
    if (node.has("matrix")) {
      std::array<double, 16> columns{};
      node.numbers("matrix", columns);
      place.matrix() = Eigen::Matrix4d::Map(columns.data());
      place.makeAffine();
      return place;
    }
    std::array<double, 3> shift = {0.0, 0.0, 0.0};
    std::array<double, 4> turn = {0.0, 0.0, 0.0, 1.0};
    std::array<double, 3> scale = {1.0, 1.0, 1.0};
    node.numbers("translation", shift);
    node.numbers("rotation", turn);
    node.numbers("scale", scale);
    const Eigen::Quaterniond rotation(turn[3], turn[0], turn[1], turn[2]);
    if (!(rotation.norm() > 0.1 && rotation.norm() < 10.0))
      node.member("rotation").fail("must be a quaternion of length 1");
    place.translate(Vec3::Map(shift.data()));
    place.rotate(rotation.normalized());
    place.scale(Vec3::Map(scale.data()));
    return place;
  }

  void addMesh(const JsonNode& mesh, const Place& place) {
    const std::vector<JsonNode> primitives = mesh.member("primitives").elements();
    // Nodes may share a mesh, so that there is more to do than a file is long.
    visited_ += 1 + primitives.size();
    if (visited_ > kMostVisits)
      mesh.fail("is one of nodes that have more than a million primitives; expected fewer");
    for (const JsonNode& primitive : primitives) {
      if (document_.error()) return;
      addPrimitive(primitive, place);
    }
  }
  void addPrimitive(const JsonNode& primitive, const Place& place) {
    const JsonNode attributes = primitive.member("attributes");
    if (!attributes.has("POSITION")) return;
    const std::size_t mode =
        primitive.index("mode", static_cast<std::size_t>(PrimitiveMode::triangles));
    if (mode > static_cast<std::size_t>(PrimitiveMode::fan))
      primitive.member("mode").fail("must be from 0 to 6");
    const std::size_t first = all_.vertices.size();
    for (const Eigen::Vector3f& at : document_.vectors(attributes.member("POSITION")))
      all_.vertices.emplace_back(place * at.cast<double>());
    ++all_.meshes;
    addCoordinates(attributes, first);
    const std::vector<std::uint32_t> corners = cornersOf(primitive, all_.vertices.size() - first);
    if (document_.error()) return;
    isMirrored_ = place.linear().determinant() < 0.0;
    first_ = static_cast<std::uint32_t>(first);
    // Strips make a triangle of each byte, and nodes may share a mesh.
    const bool isList = mode == static_cast<std::size_t>(PrimitiveMode::triangles);
    const std::size_t most = all_.polygons() + (isList ? corners.size() / 3 : corners.size());
    if (most > kMaxTriangles || all_.vertices.size() > 3 * kMaxTriangles)
      return primitive.fail("is one of more than 10 million triangles; expected fewer");
    addPolygons(static_cast<PrimitiveMode>(mode), corners);
  }
  /// Adds the texture coordinates of the first picture, if they are floats: other formats do
  /// without.
  void addCoordinates(const JsonNode& attributes, std::size_t first) {
    if (!attributes.has("TEXCOORD_0") || all_.coordinates.size() != first) return;
    const JsonNode reference = attributes.member("TEXCOORD_0");
    const JsonNode accessor = document_.root().member("accessors").element(reference, "accessor");
    if (accessor.index("componentType", 0) != kFloat) return;
    for (const Eigen::Vector2f& at : document_.pairs(reference))
      all_.coordinates.emplace_back(static_cast<double>(at.x()), 1.0 - static_cast<double>(at.y()));
    if (all_.coordinates.size() != all_.vertices.size())
      reference.fail("has not one element for each position");
  }
  std::vector<std::uint32_t> cornersOf(const JsonNode& primitive, std::size_t vertices) {
    if (primitive.has("indices")) {
      const JsonNode reference = primitive.member("indices");
      std::vector<std::uint32_t> corners = document_.meshIndices(reference);
      for (const std::uint32_t corner : corners)
        if (corner >= vertices)
          reference.fail("names vertex " + std::to_string(corner) + " of " +
                         std::to_string(vertices));
      return corners;
    }
    std::vector<std::uint32_t> corners(vertices);
    for (std::size_t index = 0; index < vertices; ++index)
      corners[index] = static_cast<std::uint32_t>(index);
    return corners;
  }

  void addPolygons(PrimitiveMode mode, const std::vector<std::uint32_t>& corners) {
    const std::size_t count = corners.size();
    switch (mode) {
      case PrimitiveMode::triangles:
        for (std::size_t at = 0; at + 2 < count; at += 3)
          addTriangle({corners[at], corners[at + 1], corners[at + 2]});
        return;
      case PrimitiveMode::strip:
        for (std::size_t at = 0; at + 2 < count; ++at)
          addTriangle({corners[at], corners[at + 1 + at % 2], corners[at + 2 - at % 2]});
        return;
      case PrimitiveMode::fan:
        for (std::size_t at = 0; at + 2 < count; ++at)
          addTriangle({corners[at + 1], corners[at + 2], corners[0]});
        return;
      default:
        all_.leftOut += mode == PrimitiveMode::lines ? count / 2 : count;
    }
  }
  void addTriangle(std::array<std::uint32_t, 3> corners) {
    if (isMirrored_) std::swap(corners[0], corners[1]);
    for (const std::uint32_t corner : corners)
      all_.corners.push_back(first_ + corner);
    all_.endPolygon();
  }

  GltfDocument document_;
  PolygonMesh all_;
  std::vector<bool> isSeen_;
  std::size_t visited_ = 0;  // primitives and the nodes that have them
  std::uint32_t first_ = 0;  // of the vertices of the present primitive
  bool isMirrored_ = false;
};

}  // namespace

Result<PolygonMesh> readGltf(std::span<const std::byte> bytes,
                             const std::optional<std::filesystem::path>& folder) {
  // An empty path says that no other file is read; one beside the program is below ".".
  std::filesystem::path where;
  if (folder) where = folder->empty() ? "." : *folder;
  Result<GltfDocument> document = GltfDocument::parse(bytes, kName, where);
  if (!document) return document.error();
  return GltfMeshReader(*std::move(document)).read();
}

}  // namespace carom::modal
