#include "modal/mesh/assimp_reader.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <new>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <Eigen/LU>
#include <assimp/BaseImporter.h>
#include <assimp/IOStream.hpp>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <assimp/MemoryIOWrapper.h>
#include <assimp/importerdesc.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include "modal/mesh/printable.h"

namespace carom::modal {

namespace {

std::string_view importerOf(std::string_view extension) {
  return extension == ".obj" ? "Wavefront Object Importer" : "Stereolithography (STL) Importer";
}

/// Lets Assimp open the mesh file and nothing else: the materials (.mtl) that an .obj names are not
/// needed.
class MeshFileAlone : public Assimp::IOSystem {
 public:
  MeshFileAlone(std::string name, std::span<const std::byte> bytes)
      : name_(std::move(name)), bytes_(bytes) {}

  bool Exists(const char* file) const override { return file == name_; }
  char getOsSeparator() const override { return '/'; }

  Assimp::IOStream* Open(const char* file, const char* mode) override {
    if (mode == nullptr || *mode != 'r' || file != name_) return nullptr;
    return std::make_unique<Assimp::MemoryIOStream>(
               reinterpret_cast<const std::uint8_t*>(bytes_.data()), bytes_.size())
        .release();
  }
  void Close(Assimp::IOStream* stream) override { std::unique_ptr<Assimp::IOStream> gone(stream); }

 private:
  std::string name_;
  std::span<const std::byte> bytes_;
};

void keepOnly(Assimp::Importer& importer, std::string_view name) {
  for (std::size_t index = importer.GetImporterCount(); index-- > 0;) {
    if (importer.GetImporterInfo(index)->mName == name) continue;
    Assimp::BaseImporter* other = importer.GetImporter(index);
    importer.UnregisterLoader(other);
    std::unique_ptr<Assimp::BaseImporter> gone(other);  // Assimp no longer owns it
  }
}

/// A mesh and where a node puts it.
struct Placed {
  const aiMesh* mesh;
  aiMatrix4x4 place;
};

std::vector<Placed> placedMeshes(const aiScene& scene) {
  std::vector<Placed> placed;
  std::vector<std::pair<const aiNode*, aiMatrix4x4>> open = {{scene.mRootNode, aiMatrix4x4()}};
  while (!open.empty()) {
    const auto [node, parent] = open.back();
    open.pop_back();
    if (node == nullptr) continue;
    const aiMatrix4x4 place = parent * node->mTransformation;
    for (unsigned index = 0; index < node->mNumMeshes; ++index)
      if (node->mMeshes[index] < scene.mNumMeshes)
        placed.push_back({scene.mMeshes[node->mMeshes[index]], place});
    for (unsigned child = node->mNumChildren; child-- > 0;)  // reversed: the first child is next
      open.emplace_back(node->mChildren[child], place);
  }
  return placed;
}

void addVertices(const Placed& placed, PolygonMesh& all) {
  const aiMatrix4x4& to = placed.place;
  Eigen::Matrix3d turn;
  turn << to.a1, to.a2, to.a3, to.b1, to.b2, to.b3, to.c1, to.c2, to.c3;
  const Vec3 shift = Eigen::Vector3f(to.a4, to.b4, to.c4).cast<double>();
  for (const aiVector3D& at : std::span(placed.mesh->mVertices, placed.mesh->mNumVertices)) {
    const Vec3 from = Eigen::Vector3f(at.x, at.y, at.z).cast<double>();
    all.vertices.emplace_back(turn * from + shift);
  }
}

/// Adds the texture coordinates of the first picture, if they are two-dimensional.
void addCoordinates(const aiMesh& mesh, PolygonMesh& all) {
  if (mesh.mTextureCoords[0] == nullptr || mesh.mNumUVComponents[0] != 2) return;
  for (const aiVector3D& at : std::span(mesh.mTextureCoords[0], mesh.mNumVertices))
    all.coordinates.emplace_back(at.x, at.y);
}

/// Adds a polygon; false if it names a vertex that its mesh does not have.
bool addFace(const aiFace& face, std::size_t first, bool mirrored, PolygonMesh& all) {
  if (face.mNumIndices < 3) {
    ++all.leftOut;
    return true;
  }
  for (const unsigned vertex : std::span(face.mIndices, face.mNumIndices)) {
    if (vertex >= all.vertices.size() - first) return false;
    all.corners.push_back(static_cast<std::uint32_t>(first + vertex));
  }
  if (mirrored) std::reverse(all.corners.end() - face.mNumIndices, all.corners.end());
  all.endPolygon();
  return true;
}

/// Adds a mesh; returns why it cannot be taken, or nothing.
std::string add(const Placed& placed, PolygonMesh& all) {
  const aiMesh& mesh = *placed.mesh;
  const std::size_t which = all.meshes++;
  if (mesh.mVertices == nullptr || mesh.mFaces == nullptr) return "";
  const std::size_t first = all.vertices.size();
  addVertices(placed, all);
  addCoordinates(mesh, all);
  const bool mirrored = placed.place.Determinant() < 0.0F;
  for (unsigned face = 0; face < mesh.mNumFaces; ++face)
    if (!addFace(mesh.mFaces[face], first, mirrored, all))
      return "polygon " + std::to_string(face) + " of mesh " + std::to_string(which) +
             " names a vertex that is not there";
  return "";
}

bool isIn(std::byte byte, std::string_view letters) {
  return letters.find(static_cast<char>(byte)) != std::string_view::npos;
}

/// Returns an OBJ file without the mark of its encoding, and with a digit before each point: of
/// ".5", Assimp 5.2.5 makes no number, and with the mark it does not know the first line.
std::vector<std::byte> plainObj(std::span<const std::byte> bytes) {
  constexpr std::array kMark{std::byte{0xef}, std::byte{0xbb}, std::byte{0xbf}};
  if (bytes.size() >= kMark.size() && std::ranges::equal(bytes.first(kMark.size()), kMark))
    bytes = bytes.subspan(kMark.size());
  std::vector<std::byte> plain;
  plain.reserve(bytes.size());
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    const bool isBare = isIn(bytes[at], ".") && at > 0 && isIn(bytes[at - 1], " \t+-") &&
                        at + 1 < bytes.size() && isIn(bytes[at + 1], "0123456789");
    if (isBare) plain.push_back(std::byte{'0'});
    plain.push_back(bytes[at]);
  }
  return plain;
}

Result<PolygonMesh> read(std::span<const std::byte> bytes, const std::string& extension) {
  const std::string name = "mesh" + extension;
  Assimp::Importer importer;
  keepOnly(importer, importerOf(extension));
  // The importer owns its handler.
  importer.SetIOHandler(std::make_unique<MeshFileAlone>(name, bytes).release());
  const aiScene* scene = importer.ReadFile(name, aiProcess_ValidateDataStructure);
  if (scene == nullptr)
    return Error{"Assimp cannot read it: " + printable(importer.GetErrorString())};
  PolygonMesh all;
  for (const Placed& placed : placedMeshes(*scene))
    if (std::string reason = add(placed, all); !reason.empty()) return Error{reason};
  if (all.coordinates.size() != all.vertices.size()) all.coordinates.clear();
  return all;
}

}  // namespace

/// Catches the exceptions of Assimp, not least for memory that a file asks for and that is not
/// there.
Result<PolygonMesh> readByAssimp(std::span<const std::byte> bytes, const std::string& extension) {
  try {
    return extension == ".obj" ? read(plainObj(bytes), extension) : read(bytes, extension);
  } catch (const std::bad_alloc&) {
    return Error{"it asks for more memory than there is"};
  } catch (const std::exception& exception) {
    return Error{"Assimp cannot read it: " + printable(exception.what())};
  }
}

}  // namespace carom::modal
