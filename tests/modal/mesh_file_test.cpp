#include "carom/modal/mesh_file.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>
#include <ostream>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/audio/meshes.h"
#include "tests/support/temporary_folder.h"

namespace carom::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// A byte string; numbers are little endian, as in all these formats here.
class Bytes {
 public:
  template <class Number>
  Bytes& put(Number number) {
    char raw[sizeof(Number)];
    std::memcpy(raw, &number, sizeof(Number));
    bytes_.append(raw, sizeof(Number));
    return *this;
  }
  Bytes& put(const Vec3& point) {
    for (const double coordinate : point)
      put(static_cast<float>(coordinate));
    return *this;
  }
  Bytes& text(const std::string& text) {
    bytes_ += text;
    return *this;
  }
  const std::string& string() const { return bytes_; }

 private:
  std::string bytes_;
};

Result<LoadedMesh> loaded(const std::string& bytes, const std::string& name,
                          const MeshImport& import = {}) {
  return meshFromBytes(std::as_bytes(std::span(bytes)), name, import);
}

std::string refusal(const std::string& bytes, const std::string& name,
                    const MeshImport& import = {}) {
  const auto mesh = loaded(bytes, name, import);
  return mesh ? "" : mesh.error().message;
}

// ---- One box of 2 x 4 x 6 in every format

const SurfaceMesh& box() {
  static const SurfaceMesh mesh = boxMesh({1.0, 2.0, 3.0});
  return mesh;
}

std::string textOf(const Vec3& point) {
  std::ostringstream text;
  text << point.x() << ' ' << point.y() << ' ' << point.z();
  return text.str();
}

/// The box as an OBJ file, with its sides as polygons of four.
std::string boxObj() {
  std::string text = "# a box\no box\n";
  for (const Vec3& vertex : box().vertices)
    text += "v " + textOf(vertex) + "\n";
  return text +
         "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\n"
         "f -8 -4 -2 -6\nf 2 4 8 6\n";
}

std::string boxPlyText() {
  std::string text =
      "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\n"
      "property float z\nelement face 12\nproperty list uchar int vertex_indices\nend_header\n";
  for (const Vec3& vertex : box().vertices)
    text += textOf(vertex) + "\n";
  for (const auto& [a, b, c] : box().triangles)
    text += "3 " + std::to_string(a) + ' ' + std::to_string(b) + ' ' + std::to_string(c) + "\n";
  return text;
}

std::string boxPlyBinary() {
  Bytes bytes;
  bytes.text(
      "ply\nformat binary_little_endian 1.0\nelement vertex 8\nproperty double x\n"
      "property double y\nproperty double z\nelement face 12\n"
      "property list uchar uint vertex_indices\nend_header\n");
  for (const Vec3& vertex : box().vertices)
    bytes.put(vertex.x()).put(vertex.y()).put(vertex.z());
  for (const auto& [a, b, c] : box().triangles)
    bytes.put(std::uint8_t{3}).put(a).put(b).put(c);
  return bytes.string();
}

std::string boxStlText() {
  std::string text = "solid box\n";
  for (const auto& triangle : box().triangles) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const std::uint32_t corner : triangle)
      text += "vertex " + textOf(box().vertices[corner]) + "\n";
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid box\n";
}

std::string boxStlBinary() {
  Bytes bytes;
  bytes.text(std::string(80, ' ')).put(static_cast<std::uint32_t>(box().triangles.size()));
  for (const auto& triangle : box().triangles) {
    bytes.put(Vec3(0.0, 0.0, 0.0));
    for (const std::uint32_t corner : triangle)
      bytes.put(box().vertices[corner]);
    bytes.put(std::uint16_t{0});
  }
  return bytes.string();
}

/// The box as a buffer: 8 positions in 96 bytes, then 36 indices in 72.
std::string boxBuffer() {
  Bytes bytes;
  for (const Vec3& vertex : box().vertices)
    bytes.put(vertex);
  for (const auto& triangle : box().triangles)
    for (const std::uint32_t corner : triangle)
      bytes.put(static_cast<std::uint16_t>(corner));
  return bytes.string();
}

/// A glTF file of the box. `buffer` is the text after the buffer's length, `nodes` the list of
/// nodes.
std::string boxGltf(const std::string& buffer,
                    const std::string& nodes = R"({"mesh": 0, "name": "box"})",
                    const std::string& roots = "0") {
  return R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [)" + roots +
         R"(]}], "nodes": [)" + nodes +
         R"(], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3",
                   "min": [-1, -2, -3], "max": [1, 2, 3]},
                  {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"}],
    "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 96},
                    {"buffer": 0, "byteOffset": 96, "byteLength": 72}],
    "buffers": [{"byteLength": 168)" +
         buffer + "}]}";
}

std::string boxGlb(const std::string& nodes = R"({"mesh": 0})", const std::string& roots = "0") {
  std::string json = boxGltf("", nodes, roots);
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const std::string binary = boxBuffer();
  const auto length = [](std::size_t size) { return static_cast<std::uint32_t>(size); };
  Bytes bytes;
  bytes.text("glTF").put(std::uint32_t{2}).put(length(12 + 8 + json.size() + 8 + binary.size()));
  bytes.put(length(json.size())).text("JSON").text(json);
  bytes.put(length(binary.size())).text(std::string("BIN\0", 4)).text(binary);
  return bytes.string();
}

struct FileOfBox {
  std::string name;
  std::string bytes;
};

void PrintTo(const FileOfBox& file, std::ostream* out) {
  *out << file.name;
}

class EveryFormat : public testing::TestWithParam<FileOfBox> {};

TEST_P(EveryFormat, GivesTheClosedBoxInMetres) {
  const auto mesh = loaded(GetParam().bytes, GetParam().name);
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->meshes, 1u);
  EXPECT_EQ(mesh->leftOut, 0u);
  EXPECT_EQ(mesh->surface.vertices.size(), 8u);
  EXPECT_EQ(mesh->surface.triangles.size(), 12u);
  EXPECT_TRUE(closedSurface(mesh->surface));
  EXPECT_NEAR(signedVolume(mesh->surface), 48.0, 1e-5);
  EXPECT_NEAR(surfaceArea(mesh->surface), 88.0, 1e-5);
}

TEST_P(EveryFormat, IsScaledByTheUnit) {
  const auto mesh = loaded(GetParam().bytes, GetParam().name, {.scale = 0.001});
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_NEAR(signedVolume(mesh->surface), 48e-9, 1e-14);
}

// A truncated file gives an error that names it, or the surface up to there, but does no harm.
TEST_P(EveryFormat, CutShortItIsRefusedOrStillASurface) {
  const std::string& bytes = GetParam().bytes;
  for (std::size_t length = 0; length < bytes.size(); length += 1 + bytes.size() / 60) {
    const auto mesh = loaded(bytes.substr(0, length), GetParam().name);
    if (mesh) {
      for (const Vec3& vertex : mesh->surface.vertices)
        EXPECT_TRUE(vertex.allFinite());
    } else {
      EXPECT_THAT(mesh.error().message, HasSubstr("mesh file '" + GetParam().name + "': "));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    MeshFile, EveryFormat,
    testing::Values(FileOfBox{"box.obj", boxObj()}, FileOfBox{"box.ply", boxPlyText()},
                    FileOfBox{"binary.ply", boxPlyBinary()}, FileOfBox{"box.stl", boxStlText()},
                    FileOfBox{"binary.STL", boxStlBinary()}, FileOfBox{"box.glb", boxGlb()}));

// ---- Coordinates of pictures

/// A square of two triangles, with u twice x and v three times y, in three formats.
std::string squareObj() {
  return "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 2 0\nvt 2 3\nvt 0 3\n"
         "f 1/1 2/2 3/3 4/4\n";
}

std::string squarePly(const std::string& u, const std::string& v) {
  return "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
         "property float z\nproperty float " +
         u + "\nproperty float " + v +
         "\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
         "0 0 0 0 0\n1 0 0 2 0\n1 1 0 2 3\n0 1 0 0 3\n4 0 1 2 3\n";
}

/// The square as GLB; v points downwards in glTF.
std::string squareGlb() {
  Bytes binary;
  for (const Vec3& vertex : {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 1, 0), Vec3(0, 1, 0)})
    binary.put(vertex);
  for (const auto& [u, v] : {std::pair{0.0F, 1.0F}, {2.0F, 1.0F}, {2.0F, -2.0F}, {0.0F, -2.0F}})
    binary.put(u).put(v);
  for (const int index : {0, 1, 2, 0, 2, 3})
    binary.put(static_cast<std::uint16_t>(index));
  std::string json =
      R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2}]}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
                   "min": [0, 0, 0], "max": [1, 1, 0]},
                  {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
                  {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"}],
    "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 48},
                    {"buffer": 0, "byteOffset": 48, "byteLength": 32},
                    {"buffer": 0, "byteOffset": 80, "byteLength": 12}],
    "buffers": [{"byteLength": 92}]})";
  json.resize((json.size() + 3) / 4 * 4, ' ');
  Bytes bytes;
  const auto length = [](std::size_t size) { return static_cast<std::uint32_t>(size); };
  bytes.text("glTF").put(std::uint32_t{2});
  bytes.put(length(12 + 8 + json.size() + 8 + binary.string().size()));
  bytes.put(length(json.size())).text("JSON").text(json);
  bytes.put(length(binary.string().size())).text(std::string("BIN\0", 4)).text(binary.string());
  return bytes.string();
}

class EveryPicture : public testing::TestWithParam<FileOfBox> {};

TEST_P(EveryPicture, LiesWhereItsFileSays) {
  const auto mesh = loaded(GetParam().bytes, GetParam().name);
  ASSERT_TRUE(mesh) << mesh.error().message;
  ASSERT_EQ(mesh->surface.triangles.size(), 2u);
  ASSERT_EQ(mesh->coordinates.size(), 2u);
  for (std::size_t index = 0; index < 2; ++index) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const Vec3& at = mesh->surface.vertices[mesh->surface.triangles[index][corner]];
      EXPECT_EQ(mesh->coordinates[index][corner], Eigen::Vector2d(2.0 * at.x(), 3.0 * at.y()));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    MeshFile, EveryPicture,
    testing::Values(FileOfBox{"square.obj", squareObj()}, FileOfBox{"uv.ply", squarePly("u", "v")},
                    FileOfBox{"st.ply", squarePly("s", "t")},
                    FileOfBox{"texture.ply", squarePly("texture_u", "texture_v")},
                    FileOfBox{"square.glb", squareGlb()}));

// A vertex on a seam of a picture has two places on the picture, and stays one vertex.
TEST(MeshFile, ASeamOfAPictureTearsNoSurface) {
  const auto mesh = loaded(
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0.5 0.5\n"
      "f 1/1 2/2 3/3\nf 1/4 3/2 4/1\n",
      "seam.obj");
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->surface.vertices.size(), 4u);
  ASSERT_EQ(mesh->coordinates.size(), 2u);
  EXPECT_EQ(mesh->coordinates[0][0], Eigen::Vector2d(0.0, 0.0));
  EXPECT_EQ(mesh->coordinates[1][0], Eigen::Vector2d(0.5, 0.5));
}

TEST(MeshFile, WithoutAPictureOnAllOfItItHasNone) {
  for (const std::string& bytes :
       {boxObj(), squareObj() + "v 0 0 1\nv 1 0 1\nv 1 1 1\no two\nf 5 6 7\n"}) {
    const auto mesh = loaded(bytes, "box.obj");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_TRUE(mesh->coordinates.empty());
  }
  const auto onlyU = loaded(squarePly("u", "w"), "u.ply");
  ASSERT_TRUE(onlyU);
  EXPECT_TRUE(onlyU->coordinates.empty());
}

// ---- glTF: nodes, and files beside it

// The file has one box at its place, and in a child another one, mirrored, half as large, 10 m
// along x.
TEST(MeshFile, NodesPlaceTheirMeshesAndMirrorsStayOutward) {
  const auto mesh = loaded(boxGlb(R"({"mesh": 0, "children": [1]},
                                     {"translation": [10, 0, 0], "children": [2]},
                                     {"mesh": 0, "scale": [-0.5, 0.5, 0.5]})"),
                           "two.glb");
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->meshes, 2u);
  EXPECT_EQ(mesh->surface.triangles.size(), 24u);
  EXPECT_TRUE(closedSurface(mesh->surface));
  EXPECT_NEAR(signedVolume(mesh->surface), 48.0 + 48.0 / 8.0, 1e-5);
  EXPECT_NEAR(volumeCentroid(mesh->surface).x(), 10.0 / 9.0, 1e-6);
}

// A quarter turn about z makes the box 4 x 2 instead of 2 x 4.
TEST(MeshFile, NodesTurnTheirMeshes) {
  const auto mesh =
      loaded(boxGlb(R"({"mesh": 0, "rotation": [0, 0, 0.70710678, 0.70710678]})"), "turned.glb");
  ASSERT_TRUE(mesh) << mesh.error().message;
  double widest = 0.0;
  for (const Vec3& vertex : mesh->surface.vertices)
    widest = std::max(widest, vertex.x());
  EXPECT_NEAR(widest, 2.0, 1e-6);
}

TEST(MeshFile, AGltfFindsItsBufferBesideItAndNowhereElse) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "inner");
  const auto write = [&](const std::string& name, const std::string& bytes) {
    std::ofstream(folder / name, std::ios::binary) << bytes;
    return folder / name;
  };
  write("box.bin", boxBuffer());
  std::filesystem::create_directory(folder / "beside");
  write("inner/box.bin", boxBuffer());
  const auto with = [](const std::string& uri) { return boxGltf(R"(, "uri": ")" + uri + "\""); };
  for (const auto* uri : {"box.bin", "inner/box.bin"}) {
    const auto mesh = loadMesh(write("good.gltf", with(uri)));
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_NEAR(signedVolume(mesh->surface), 48.0, 1e-5);
  }
  for (const std::string& uri :
       {std::string("../box.bin"), (folder / "box.bin").string(), std::string("none.bin")}) {
    const auto mesh = loadMesh(write("beside/bad.gltf", with(uri)));
    ASSERT_FALSE(mesh) << uri;
    EXPECT_THAT(mesh.error().message, AllOf(HasSubstr("bad.gltf': "), HasSubstr(".bin")));
  }
}

// ---- Other contents

TEST(MeshFile, ManyMeshesAreOneAndWhatTouchesIsWelded) {
  const auto mesh = loaded(
      "o left\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
      "o right\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 4 5 6\n",
      "two.obj");
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->meshes, 2u);
  EXPECT_EQ(mesh->surface.vertices.size(), 4u);
  EXPECT_NEAR(surfaceArea(mesh->surface), 1.0, 1e-6);
}

TEST(MeshFile, WeldingIsRelativeToTheExtentAndCanBeSet) {
  // Two triangles with legs of 1000 that are 0.01 apart at one corner.
  const std::string text =
      "v 0 0 0\nv 1000 0 0\nv 0 1000 0\nv 1000 1000 0\nv 1000.01 0 0\nf 1 2 3\nf 5 4 3\n";
  const auto strict = loaded(text, "gap.obj");
  const auto loose = loaded(text, "gap.obj", {.weldTolerance = 1e-4});
  ASSERT_TRUE(strict && loose);
  EXPECT_EQ(strict->surface.vertices.size(), 5u);
  EXPECT_EQ(loose->surface.vertices.size(), 4u);
}

// The polygon is an L of three unit squares; its concave corner at (1, 1) is not bridged.
TEST(MeshFile, ConcavePolygonsKeepTheirArea) {
  const auto mesh =
      loaded("v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nf 1 2 3 4 5 6\n", "l.obj");
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->surface.triangles.size(), 4u);
  EXPECT_NEAR(surfaceArea(mesh->surface), 3.0, 1e-6);
}

// It goes twice round a circle, and so has no ear; to look for one at each corner anew would take
// minutes.
TEST(MeshFile, APolygonWithoutEarsIsCutAllTheSame) {
  std::string text;
  std::string face = "f";
  constexpr int kCorners = 4096;
  for (int corner = 0; corner < kCorners; ++corner) {
    const double angle = 4.0 * std::numbers::pi * corner / kCorners;
    text += "v " + std::to_string(std::cos(angle)) + ' ' + std::to_string(std::sin(angle)) + " 0\n";
    face += ' ' + std::to_string(corner + 1);
  }
  const auto mesh = loaded(text + face + '\n', "twice.obj");
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_NEAR(surfaceArea(mesh->surface), 2.0 * std::numbers::pi, 1e-2);
}

// As editors on Windows begin a file, and as C's printf writes numbers nowhere, but other programs.
TEST(MeshFile, AnObjMayBeginWithAMarkAndItsNumbersWithAPoint) {
  const auto mesh =
      loaded("\xef\xbb\xbfv .5 0 -.5\nv 1.5\t+.25 .0\nv 0 1. 0\nf 1 2 3\n", "points.obj");
  ASSERT_TRUE(mesh) << mesh.error().message;
  ASSERT_EQ(mesh->surface.vertices.size(), 3u);
  EXPECT_EQ(mesh->surface.vertices[0], Vec3(0.5, 0.0, -0.5));
  EXPECT_EQ(mesh->surface.vertices[1], Vec3(1.5, 0.25, 0.0));
  EXPECT_EQ(mesh->surface.vertices[2], Vec3(0.0, 1.0, 0.0));
}

TEST(MeshFile, LinesAndVanishingTrianglesAreCounted) {
  const auto mesh =
      loaded("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nl 1 4\nf 1 2 3\nf 1 2 2\n", "lines.obj");
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->surface.triangles.size(), 1u);
  EXPECT_EQ(mesh->leftOut + mesh->vanished, 2u);
}

// ---- Refused files

TEST(MeshFile, SaysWhatIsWrongWithThePath) {
  const TemporaryFolder folder;
  const auto refusalOf = [](const std::filesystem::path& path) {
    const auto mesh = loadMesh(path);
    return mesh ? "" : mesh.error().message;
  };
  std::ofstream(folder / "box.fbx") << "x";
  std::ofstream(folder / "none.obj").close();
  EXPECT_THAT(refusalOf(folder / "gone.obj"),
              AllOf(HasSubstr("gone.obj': "), HasSubstr("there is no such file")));
  EXPECT_THAT(refusalOf(folder.path()), HasSubstr("it is a folder; expected a file"));
  EXPECT_THAT(refusalOf("/dev/null"), HasSubstr("it is not a regular file"));
  EXPECT_THAT(refusalOf(folder / "box.fbx"),
              HasSubstr("its name ends in '.fbx'; expected .obj, .ply, .stl, .gltf or .glb"));
  EXPECT_THAT(refusalOf(folder / "none.obj"),
              HasSubstr("none.obj': it is empty; expected a whole OBJ, PLY, STL or glTF file"));
}

TEST(MeshFile, SaysWhatIsWrongInside) {
  EXPECT_THAT(refusal("v 0 0 0\nv 1 0 0\nv 0 1 0\n", "points.obj"), HasSubstr("points.obj': "));
  EXPECT_THAT(refusal("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 1 2\n", "flat.obj"),
              HasSubstr("it has no triangles"));
  EXPECT_THAT(refusal("hello", "text.stl"), HasSubstr("text.stl': Assimp cannot read it: "));
  EXPECT_THAT(refusal("<html></html>", "page.gltf"), HasSubstr("its glTF: is no glTF"));
  EXPECT_THAT(refusal("v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n", "nan.obj"),
              HasSubstr("nan.obj': "));
}

TEST(MeshFile, RefusesIndicesThatAreOutOfRange) {
  EXPECT_THAT(refusal("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 7\n", "range.obj"),
              HasSubstr("range.obj': "));
  std::string ply = boxPlyText();
  ply.replace(ply.rfind("3 1 7 5"), 7, "3 1 9 5");
  EXPECT_THAT(refusal(ply, "range.ply"), HasSubstr("range.ply': polygon 11 names vertex 9 of 8"));
}

// Assimp read beyond the ends of its memory where a buffer has less than its accessors state.
// A file of a megabyte that would be gone through for hours.
TEST(MeshFile, AGltfOfWhichNodesShareTooMuchIsRefused) {
  const auto times = [](int count, const std::string& what) {
    std::string list;
    for (int one = 0; one < count; ++one)
      list += (one > 0 ? "," : "") + what;
    return list;
  };
  std::string roots;
  for (int node = 0; node < 2000; ++node)
    roots += (node > 0 ? "," : "") + std::to_string(node);
  const std::string text = R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[)" + roots +
                           R"(]}],"nodes":[)" + times(2000, R"({"mesh":0})") +
                           R"(],"meshes":[{"primitives":[)" + times(1000, R"({"attributes":{}})") +
                           "]}]}";
  EXPECT_THAT(refusal(text, "many.gltf"), HasSubstr("more than a million primitives"));
}

TEST(MeshFile, AGltfWhoseNumbersContradictEachOtherIsRefusedWithItsPlace) {
  std::string range = boxGlb();
  range.replace(range.size() - 2, 2, "\x09\x00", 2);
  EXPECT_THAT(refusal(range, "a.glb"),
              HasSubstr("/meshes/0/primitives/0/indices: names vertex 9 of 8"));
  const auto with = [](const std::string& old, const std::string& wild) {
    std::string bytes = boxGlb();
    // A change of the same length leaves the chunks as they are.
    EXPECT_EQ(old.size(), wild.size());
    bytes.replace(bytes.find(old), old.size(), wild);
    return refusal(bytes, "a.glb");
  };
  EXPECT_THAT(with(R"("count": 8)", R"("count": 9)"),
              HasSubstr("/accessors/0: reaches beyond its buffer view"));
  EXPECT_THAT(with(R"("byteLength": 72)", R"("byteLength": 99)"),
              HasSubstr("/bufferViews/1: reaches beyond its buffer"));
  EXPECT_THAT(with(R"("byteLength": 168)", R"("byteLength": 999)"),
              HasSubstr("/buffers/0/byteLength: is 999, and there are 168 bytes"));
  EXPECT_THAT(with(R"("byteOffset": 96)", R"("byteOffset": -1)"), HasSubstr("byteOffset"));
  EXPECT_THAT(with(R"("VEC3")", R"("VEC9")"), HasSubstr("must be \"VEC3\""));
}

TEST(MeshFile, AGltfThatShowsNothingOrIsCompressedIsRefused) {
  EXPECT_THAT(refusal(R"({"asset": {"version": "2.0"}})", "a.gltf"),
              HasSubstr("/scenes: is missing: without a scene nothing is shown"));
  EXPECT_THAT(refusal(R"({"asset": {"version": "2.0"}, "scenes": [{}],
                          "extensionsRequired": ["KHR_draco_mesh_compression"]})",
                      "a.gltf"),
              HasSubstr("/extensionsRequired/0: is not read here; write the file without"));
}

TEST(MeshFile, AGltfWhoseNodesAreNoTreeIsRefused) {
  for (const auto* nodes :
       {R"({"mesh": 0, "children": [0]})", R"({"children": [1, 1]}, {"mesh": 0})",
        R"({"children": [1]}, {"mesh": 0, "children": [0]})"})
    EXPECT_THAT(refusal(boxGlb(nodes), "a.glb"),
                HasSubstr("names a node that is in the tree already"));
  EXPECT_THAT(refusal(boxGlb(R"({"mesh": 3})"), "a.glb"), HasSubstr("is mesh 3, and there are 1"));
  EXPECT_THAT(refusal(boxGlb(R"({"mesh": 0, "rotation": [0, 0, 0, 0]})"), "a.glb"),
              HasSubstr("/nodes/0/rotation: must be a quaternion of length 1"));
}

// The unit square by two triangles, as each kind of primitive makes them.
TEST(MeshFile, AGltfHasTrianglesStripsAndFans) {
  const auto trianglesOf = [](const std::string& mode, const std::string& corners) {
    std::string json =
        R"({"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "mode": )" +
        mode + R"(}]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
                          {"bufferView": 1, "componentType": 5121, "count": )" +
        std::to_string(corners.size()) + R"(, "type": "SCALAR"}],
            "bufferViews": [{"buffer": 0, "byteLength": 48},
                            {"buffer": 0, "byteOffset": 48, "byteLength": )" +
        std::to_string(corners.size()) + R"(}], "buffers": [{"byteLength": )" +
        std::to_string(48 + corners.size()) + "}]}";
    json.resize((json.size() + 3) / 4 * 4, ' ');
    Bytes binary;
    for (const Vec3& vertex : {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(1, 1, 0)})
      binary.put(vertex);
    const std::string data =
        binary.string() + corners + std::string((4 - corners.size() % 4) % 4, '\0');
    const auto length = [](std::size_t size) { return static_cast<std::uint32_t>(size); };
    Bytes bytes;
    bytes.text("glTF").put(std::uint32_t{2}).put(length(28 + json.size() + data.size()));
    bytes.put(length(json.size())).text("JSON").text(json);
    bytes.put(length(data.size())).text(std::string("BIN\0", 4)).text(data);
    const auto mesh = loaded(bytes.string(), "square.glb");
    EXPECT_TRUE(mesh) << mesh.error().message;
    // All look upwards, and cover the square once.
    EXPECT_NEAR(surfaceArea(mesh->surface), 1.0, 1e-6) << mode;
    for (const auto& [a, b, c] : mesh->surface.triangles) {
      const auto& at = mesh->surface.vertices;
      EXPECT_GT((at[b] - at[a]).cross(at[c] - at[a]).z(), 0.0) << mode;
    }
    return mesh->surface.triangles.size();
  };
  EXPECT_EQ(trianglesOf("4", std::string("\0\1\2\1\3\2", 6)), 2u);
  EXPECT_EQ(trianglesOf("5", std::string("\0\1\2\3", 4)), 2u);
  EXPECT_EQ(trianglesOf("6", std::string("\0\1\3\2", 4)), 2u);
}

// In any coordinate: the largest of three numbers may be one although another is none.
TEST(MeshFile, RefusesNumbersOutOfRange) {
  const std::string ply = boxPlyBinary();  // doubles
  const std::string stl = boxStlBinary();  // floats
  const std::size_t inPly = ply.find("end_header\n") + 11;
  const std::size_t inStl = 84 + 12;
  const auto changed = [](std::string bytes, std::size_t at, auto number) {
    std::memcpy(&bytes[at], &number, sizeof number);
    return bytes;
  };
  for (const std::size_t coordinate : {0U, 1U, 2U})
    for (const double bad : {std::numeric_limits<double>::infinity(),
                             std::numeric_limits<double>::quiet_NaN(), 1.1e9, -1e30}) {
      const auto expected = HasSubstr(
          "vertex 0 is not finite or too far away; expected coordinates from -1e9 to 1e9");
      EXPECT_THAT(refusal(changed(ply, inPly + 8 * coordinate, bad), "bad.ply"), expected);
      EXPECT_THAT(refusal(changed(stl, inStl + 4 * coordinate, static_cast<float>(bad)), "bad.stl"),
                  expected);
    }
}

TEST(MeshFile, RefusesSettingsOutOfRange) {
  EXPECT_THAT(refusal(boxObj(), "box.obj", {.scale = 0.0}), HasSubstr("the scale must be"));
  EXPECT_THAT(refusal(boxObj(), "box.obj", {.scale = -1.0}), HasSubstr("the scale must be"));
  EXPECT_THAT(refusal(boxObj(), "box.obj", {.weldTolerance = 0.5}), HasSubstr("from 0 to 0.1"));
}

}  // namespace
}  // namespace carom::test
