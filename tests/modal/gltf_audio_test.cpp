#include "carom/modal/gltf_audio.h"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace carom::test {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;
using testing::StartsWith;

/// A file of the draft, written by hand, with everything that the draft has.
const std::string& bellText() {
  static const std::string text =
      contents(fs::path(CAROM_SOURCE_DIR) / "tests" / "modal" / "data" / "bell.gltf");
  return text;
}

std::span<const std::byte> bytesOf(const std::string& text) {
  return std::as_bytes(std::span(text));
}

/// Returns the bell's file with one text replaced.
std::string bellWith(const std::string& before, const std::string& after) {
  std::string text = bellText();
  const std::size_t at = text.find(before);
  EXPECT_NE(at, std::string::npos) << before;
  return text.replace(at, before.size(), after);
}

std::string refusal(const std::string& text) {
  const auto audio = parseGltfAudio(bytesOf(text), "x.gltf");
  return audio ? "" : audio.error().message;
}

GltfAudio bell() {
  const auto audio = parseGltfAudio(bytesOf(bellText()), "bell.gltf");
  EXPECT_TRUE(audio) << audio.error().message;
  return audio ? *audio : GltfAudio();
}

TEST(GltfAudio, ReadsAModelOfTheDraft) {
  const GltfAudio audio = bell();
  ASSERT_THAT(audio.models, SizeIs(1));
  const GltfModalModel& model = audio.models[0];
  EXPECT_EQ(model.name, "Bell");
  EXPECT_THAT(model.frequencies, ElementsAre(440.0F, 220.0F));
  EXPECT_THAT(model.decayRates, ElementsAre(2.0F, 0.5F));
  ASSERT_THAT(model.positions, SizeIs(4));
  EXPECT_EQ(model.positions[3], Eigen::Vector3f(0, 0, 1));
  ASSERT_THAT(model.shapes, SizeIs(8));
  EXPECT_EQ(model.shapes[3], Eigen::Vector3f(4, 5, 6));
  EXPECT_EQ(model.shapes[6], Eigen::Vector3f(0, 0, 0.125));
  EXPECT_THAT(model.indices, ElementsAre(0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2));
  EXPECT_EQ(model.material, 0u);
  ASSERT_TRUE(model.massProperties);
  EXPECT_EQ(model.massProperties->mass, 12.5);
  EXPECT_EQ(model.massProperties->centreOfMass, Vec3(0.25, 0.25, 0.25));
  EXPECT_EQ(model.massProperties->inertiaDiagonal, Vec3(1, 2, 3));
  EXPECT_NEAR(model.massProperties->inertiaOrientation.z(), std::sqrt(0.5), 1e-15);
}

TEST(GltfAudio, ReadsMaterialsAndSurfacesOfTheDraft) {
  const GltfAudio audio = bell();
  ASSERT_THAT(audio.materials, SizeIs(2));
  EXPECT_EQ(audio.materials[0].name, "Bronze");
  EXPECT_EQ(audio.materials[0].youngsModulus, 1.1e11);
  EXPECT_EQ(audio.materials[0].poissonRatio, 0.34);
  EXPECT_EQ(audio.materials[0].alpha, 6.0);
  EXPECT_EQ(audio.materials[0].beta, 1e-7);
  EXPECT_EQ(audio.materials[1].density, 2500.0);
  EXPECT_FALSE(audio.materials[1].youngsModulus);
  EXPECT_FALSE(audio.materials[1].restitution);

  ASSERT_THAT(audio.surfaces, SizeIs(2));
  EXPECT_EQ(audio.surfaces[0].roughness, 3e-7);
  EXPECT_EQ(audio.surfaces[0].correlationLength, 2e-5);
  EXPECT_EQ(audio.surfaces[0].spectralSlope, -2.75);
  EXPECT_EQ(audio.surfaces[0].waviness, 2e-6);        // the draft's default
  EXPECT_EQ(audio.surfaces[0].wavinessLength, 2e-3);  // the draft's default
  EXPECT_EQ(audio.surfaces[0].material, 0u);
  EXPECT_EQ(audio.surfaces[1].roughness, 2e-6);          // the draft's default
  EXPECT_EQ(audio.surfaces[1].correlationLength, 5e-5);  // the draft's default
  EXPECT_EQ(audio.surfaces[1].spectralSlope, -2.4);      // the draft's default
  EXPECT_THAT(audio.surfaces[1].profile, ElementsAre(1e-6F, -1e-6F, 0.0F));
  EXPECT_EQ(audio.surfaces[1].sampleSpacing, 5e-6);
  EXPECT_EQ(audio.surfaces[1].shortWavelength, 1e-6);
  EXPECT_EQ(audio.surfaces[1].normalTexture, 2u);
  EXPECT_EQ(audio.surfaces[1].normalTexCoord, 1u);
}

// The bell is turned by half a turn about z and stands at (1, 0, 0) in a tower of scale 2 at height
// 10: its point (1, 0, 0) is at (1 - 1, 0, 0) in the tower, and its origin at (2, 10, 0).
TEST(GltfAudio, NodesStandWhereTheirParentsPutThem) {
  const GltfAudio audio = bell();
  ASSERT_THAT(audio.nodes, SizeIs(2));
  EXPECT_EQ(audio.nodes[0].name, "Bell");
  EXPECT_EQ(audio.nodes[0].modalModel, 0u);
  EXPECT_EQ(audio.nodes[0].acousticSurface, 0u);
  EXPECT_EQ(audio.nodes[0].gain, 0.5);
  const Eigen::Matrix4d& transform = audio.nodes[0].globalTransform;
  EXPECT_TRUE((transform * Eigen::Vector4d(0, 0, 0, 1)).isApprox(Eigen::Vector4d(2, 10, 0, 1)));
  EXPECT_TRUE((transform * Eigen::Vector4d(1, 0, 0, 1)).isApprox(Eigen::Vector4d(0, 10, 0, 1)));
  EXPECT_EQ(audio.nodes[1].name, "Floor");
  EXPECT_FALSE(audio.nodes[1].modalModel);
  EXPECT_EQ(audio.nodes[1].gain, 1.0);
}

void expectSame(const GltfAudio& one, const GltfAudio& other) {
  ASSERT_EQ(one.models.size(), other.models.size());
  for (std::size_t index = 0; index < one.models.size(); ++index) {
    const GltfModalModel& model = one.models[index];
    const GltfModalModel& again = other.models[index];
    EXPECT_EQ(model.name, again.name);
    EXPECT_EQ(model.frequencies, again.frequencies);
    EXPECT_EQ(model.decayRates, again.decayRates);
    EXPECT_EQ(model.positions, again.positions);
    EXPECT_EQ(model.shapes, again.shapes);
    EXPECT_EQ(model.indices, again.indices);
    EXPECT_EQ(model.material, again.material);
    EXPECT_EQ(model.volumes, again.volumes);
    ASSERT_EQ(model.massProperties.has_value(), again.massProperties.has_value());
    if (!model.massProperties) continue;
    EXPECT_EQ(model.massProperties->mass, again.massProperties->mass);
    EXPECT_EQ(model.massProperties->centreOfMass, again.massProperties->centreOfMass);
    EXPECT_EQ(model.massProperties->inertiaDiagonal, again.massProperties->inertiaDiagonal);
    EXPECT_EQ(model.massProperties->inertiaOrientation.coeffs(),
              again.massProperties->inertiaOrientation.coeffs());
  }
  ASSERT_EQ(one.materials.size(), other.materials.size());
  for (std::size_t index = 0; index < one.materials.size(); ++index) {
    EXPECT_EQ(one.materials[index].name, other.materials[index].name);
    EXPECT_EQ(one.materials[index].density, other.materials[index].density);
    EXPECT_EQ(one.materials[index].youngsModulus, other.materials[index].youngsModulus);
    EXPECT_EQ(one.materials[index].poissonRatio, other.materials[index].poissonRatio);
    EXPECT_EQ(one.materials[index].alpha, other.materials[index].alpha);
    EXPECT_EQ(one.materials[index].beta, other.materials[index].beta);
    EXPECT_EQ(one.materials[index].restitution, other.materials[index].restitution);
  }
  ASSERT_EQ(one.surfaces.size(), other.surfaces.size());
  for (std::size_t index = 0; index < one.surfaces.size(); ++index) {
    EXPECT_EQ(one.surfaces[index].roughness, other.surfaces[index].roughness);
    EXPECT_EQ(one.surfaces[index].spectralSlope, other.surfaces[index].spectralSlope);
    EXPECT_EQ(one.surfaces[index].shortWavelength, other.surfaces[index].shortWavelength);
    EXPECT_EQ(one.surfaces[index].waviness, other.surfaces[index].waviness);
    EXPECT_EQ(one.surfaces[index].profile, other.surfaces[index].profile);
    EXPECT_EQ(one.surfaces[index].sampleSpacing, other.surfaces[index].sampleSpacing);
    EXPECT_EQ(one.surfaces[index].material, other.surfaces[index].material);
  }
  ASSERT_EQ(one.nodes.size(), other.nodes.size());
  for (std::size_t index = 0; index < one.nodes.size(); ++index) {
    EXPECT_EQ(one.nodes[index].name, other.nodes[index].name);
    EXPECT_EQ(one.nodes[index].modalModel, other.nodes[index].modalModel);
    EXPECT_EQ(one.nodes[index].acousticSurface, other.nodes[index].acousticSurface);
    EXPECT_EQ(one.nodes[index].gain, other.nodes[index].gain);
    EXPECT_EQ(one.nodes[index].globalTransform, other.nodes[index].globalTransform);
  }
}

TEST(GltfAudio, IsTheSameAfterWriting) {
  const TemporaryFolder folder;
  GltfAudio audio = bell();
  audio.models.push_back(audio.models[0]);  // without everything that may be absent
  audio.models[1].indices.clear();
  audio.models[1].material.reset();
  audio.models[1].massProperties.reset();
  audio.models[0].volumes = {0.5, -1e-9};
  audio.materials[1].restitution = 0.7;
  for (const std::string name : {"a.gltf", "a.glb"}) {
    const auto written = writeGltfAudio(folder / name, audio);
    ASSERT_TRUE(written) << written.error().message;
    const auto again = readGltfAudio(folder / name);
    ASSERT_TRUE(again) << again.error().message;
    expectSame(audio, *again);
  }
  EXPECT_EQ(folder.entries(), 2u);
}

// The GLB format, section 4 of the glTF specification, has a header of 12 bytes, then chunks of
// whole words.
TEST(GltfAudio, GlbHasTheHeaderOfItsSpecification) {
  const TemporaryFolder folder;
  ASSERT_TRUE(writeGltfAudio(folder / "a.glb", bell()));
  const std::string file = contents(folder / "a.glb");
  const auto word = [&file](std::size_t at) {
    std::size_t value = 0;
    for (std::size_t byte = 4; byte-- > 0;)
      value = value << 8U | static_cast<unsigned char>(file[at + byte]);
    return value;
  };
  EXPECT_EQ(file.substr(0, 4), "glTF");
  EXPECT_EQ(word(4), 2u);
  EXPECT_EQ(word(8), file.size());
  EXPECT_EQ(file.substr(16, 4), "JSON");
  EXPECT_EQ(word(12) % 4, 0u);
  const std::size_t binary = 20 + word(12);
  EXPECT_EQ(file.substr(binary + 4, 4), std::string("BIN\0", 4));
  EXPECT_EQ(binary + 8 + word(binary), file.size());
}

TEST(GltfAudio, ReadsBuffersOfOtherFilesBelowItsFolder) {
  const TemporaryFolder folder;
  const GltfAudio audio = bell();
  const std::string start = "\"uri\": \"data:";
  const std::size_t at = bellText().find(start);
  const std::size_t end = bellText().find('"', at + start.size());
  const auto with = [&](const std::string& uri) {
    std::string text = bellText();
    return text.replace(at, end + 1 - at, "\"uri\": \"" + uri + "\"");
  };
  // The numbers that the base64 text stands for, typed.
  const std::vector<float> floats = {440,  220, 2, 0.5F, 0,     0, 0, 1, 0,      0,  0,  1, 0, 0,
                                     0,    1,   1, 0,    0,     0, 2, 0, 0,      0,  3,  4, 5, 6,
                                     0.5F, 0,   0, 0,    0.25F, 0, 0, 0, 0.125F, -1, -2, -3};
  const std::vector<std::uint16_t> indices = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};
  const std::vector<float> profile = {1e-6F, -1e-6F, 0.0F};
  fs::create_directory(folder / "sub folder");
  std::ofstream data(folder / "sub folder" / "bell.bin", std::ios::binary);
  const auto put = [&data](const auto& values) {
    data.write(reinterpret_cast<const char*>(values.data()),
               static_cast<std::streamsize>(values.size() * sizeof values[0]));
  };
  put(floats), put(indices), put(profile);
  data.close();
  std::ofstream(folder / "b.gltf") << with("sub%20folder/bell.bin");
  const auto read = readGltfAudio(folder / "b.gltf");
  ASSERT_TRUE(read) << read.error().message;
  expectSame(*read, audio);

  EXPECT_THAT(refusal(with("sub%20folder/bell.bin")), HasSubstr("none is read here"));
  for (const std::string uri : {"../bell.bin", "/etc/passwd", "file:///etc/passwd",
                                "http://there/bell.bin", "a%2", "a%00b", "%2e%2e/bell.bin", ""}) {
    std::ofstream(folder / "b.gltf") << with(uri);
    const auto refused = readGltfAudio(folder / "b.gltf");
    ASSERT_FALSE(refused) << uri;
    EXPECT_THAT(refused.error().message,
                HasSubstr("/buffers/0/uri: must be base64, or the path of a file below"))
        << uri;
  }
  std::ofstream(folder / "b.gltf") << with("absent.bin");
  const auto absent = readGltfAudio(folder / "b.gltf");
  ASSERT_FALSE(absent);
  EXPECT_THAT(absent.error().message, HasSubstr("'absent.bin': there is no such file"));
}

struct Fault {
  std::string before, after;
  std::string message;
};

TEST(GltfAudio, PointsAtWhatIsWrong) {
  const std::string extension = "/extensions/KHR_audio_rigid_bodies";
  const std::string model = extension + "/modalModels/0";
  const std::vector<Fault> faults = {
      {R"("version": "2.0")", R"("version": "1.0")", "/asset/version: must be \"2.0\""},
      {R"("version": "2.0")", R"("version": 2)", "/asset/version: must be a string"},
      {R"("KHR_audio_rigid_bodies": {
)",
       R"("KHR_audio": {
)",
       "has no /extensions/KHR_audio_rigid_bodies"},
      // References.
      {R"("frequencies": 0, )", "", model + "/frequencies: must be an integer from 0"},
      {R"("decayRates": 1)", R"("decayRates": 9)",
       model + "/decayRates: is accessor 9, and there are 6"},
      {R"("positions": 2)", R"("positions": -2)", model + "/positions: must be an integer from 0"},
      {R"("positions": 2)", R"("positions": 2.5)", model + "/positions: must be an integer from 0"},
      {R"("shapes": 3)", R"("shapes": 2)",
       model + "/shapes: must be as many as frequencies times positions"},
      {R"("decayRates": 1)", R"("decayRates": 5)", model + "/decayRates: must be as many as"},
      {R"("indices": 4, "material": 0)", R"("indices": 4, "material": 2)",
       model + "/material: must be the index of an acoustic material, and there are 2"},
      // Accessors.
      {R"("componentType": 5126, "count": 2)", R"("componentType": 5123, "count": 2)",
       "/accessors/0/componentType: must be 5126, floats"},
      {R"("componentType": 5126, "count": 2)",
       R"("componentType": 5126, "normalized": true, "count": 2)",
       "/accessors/0/normalized: must be false"},
      {R"("componentType": 5126, "count": 2)", R"("componentType": 5126, "sparse": {}, "count": 2)",
       "/accessors/0/sparse: is not read here"},
      {R"("count": 2, "type": "SCALAR")", R"("count": 2, "type": "VEC2")",
       "/accessors/0/type: must be \"SCALAR\""},
      {R"("count": 4, "type": "VEC3")", R"("count": 4, "type": "SCALAR")",
       "/accessors/2/type: must be \"VEC3\""},
      {R"("componentType": 5123)", R"("componentType": 5126)",
       "/accessors/4/componentType: must be 5125 or 5123"},
      {R"("componentType": 5123)", R"("componentType": 5121)",
       "/accessors/4/componentType: must be 5125 or 5123"},
      {R"({"bufferView": 0, "componentType")", R"({"componentType")",
       "/accessors/0/bufferView: is missing"},
      {R"({"bufferView": 0, "componentType")", R"({"bufferView": 4, "componentType")",
       "/accessors/0/bufferView: is buffer view 4, and there are 4"},
      {R"("count": 2,)", R"("count": 0,)", "/accessors/0/count: must be an integer from 1"},
      {R"("count": 2,)", R"("count": 5,)", "/accessors/0: reaches beyond its buffer view"},
      {R"("count": 2,)", R"("count": 18446744073709551615,)",
       "/accessors/0: reaches beyond its buffer view"},
      {R"("byteOffset": 8)", R"("byteOffset": 18446744073709551615)",
       "/accessors/1: reaches beyond its buffer view"},
      {R"("byteStride": 12)", R"("byteStride": 0)", "/bufferViews/1/byteStride: is less than"},
      {R"("byteStride": 12)", R"("byteStride": 8)", "/bufferViews/1/byteStride: is less than"},
      {R"("byteLength": 144)", R"("byteLength": 1440)",
       "/bufferViews/1: reaches beyond its buffer"},
      {R"({"buffer": 0, "byteOffset": 0,)", R"({"buffer": 1, "byteOffset": 0,)",
       "/bufferViews/0/buffer: is buffer 1, and there are 1"},
      {R"("byteLength": 196)", R"("byteLength": 197)",
       "/buffers/0/byteLength: is 197, and there are 196 bytes"},
      {"base64,AADc", "base64,AAD!", "/buffers/0/uri: is no base64"},
      {"base64,AADc", "base64,AAD", "/buffers/0/uri: is no base64"},
      {";base64,", ",", "/buffers/0/uri: must be base64"},
      // Values: 440 Hz becomes -440, then not a number; a corner of a triangle becomes 4.
      {"base64,AADcQw", "base64,AADcww", model + "/frequencies: must be positive"},
      {"base64,AADcQw", "base64,AADAfw", model + "/frequencies: must be positive"},
      {"wAAAAgAB", "wAAABAAB", model + "/indices: must each be less than"},
      // Mass, materials, surfaces and nodes.
      {R"("mass": 12.5)", R"("mass": 0)", model + "/massProperties/mass: must be positive"},
      {R"({"mass": 12.5,)", "{", model + "/massProperties/mass: must be a number"},
      {R"("centerOfMass": [0.25,)", R"("centerOfMass": [0,0.25,)",
       model + "/massProperties/centerOfMass: must be an array of 3 numbers"},
      {R"("centerOfMass": [0.25,)", R"("centerOfMass": ["",)",
       model + "/massProperties/centerOfMass/0: must be a number"},
      {R"([1, 2, 3])", R"([1, 2, -3])", model + "/massProperties/inertiaDiagonal: must be"},
      {R"([0, 0, 0.70710678118654752, )", R"([0, 0, 0, )",
       model + "/massProperties/inertiaOrientation: must be a quaternion"},
      {R"("density": 8800)", R"("density": 0)",
       extension + "/acousticMaterials/0/density: must be positive"},
      {R"("density": 8800)", R"("density": "8800")",
       extension + "/acousticMaterials/0/density: must be a number"},
      {"1.1e11", "-1", extension + "/acousticMaterials/0/youngsModulus: must be positive"},
      {"0.34", "0.5", extension + "/acousticMaterials/0/poissonRatio: must be above"},
      {R"("alpha": 6)", R"("alpha": -6)", extension + "/acousticMaterials/0/alpha: must be at"},
      {R"("beta": 1e-7)", R"("beta": -1)", extension + "/acousticMaterials/0/beta: must be at"},
      {"3e-7", "0", extension + "/acousticSurfaces/0/roughness: must be positive"},
      {"-2.75", "1", extension + "/acousticSurfaces/0/spectralSlope: must be at most 0"},
      {R"(, "wavinessLength": 4e-3)", "",
       extension + "/acousticSurfaces/1/wavinessLength: is missing"},
      {R"("sampleSpacing": 5e-6, )", "",
       extension + "/acousticSurfaces/1/sampleSpacing: must be positive"},
      {R"("normalTexture": {"index": 2,)", R"("normalTexture": {)",
       extension + "/acousticSurfaces/1/normalTexture/index: must be an integer"},
      {R"("modalModel": 0)", R"("modalModel": 1)",
       "/nodes/1/extensions/KHR_audio_rigid_bodies: modalModel must be the index of one, and there "
       "are 1"},
      {R"("acousticSurface": 1)", R"("acousticSurface": 2)",
       "/nodes/2/extensions/KHR_audio_rigid_bodies: acousticSurface must be"},
      {R"("gain": 0.5)", R"("gain": -1)",
       "/nodes/1/extensions/KHR_audio_rigid_bodies: gain must be at least 0"},
      {R"("children": [1])", R"("children": [0])", "/nodes/0: or another node is a descendant"},
      {R"("children": [1])", R"("children": [1, 1])",
       "/nodes/0/children/1: must be the index of a node that has no other parent"},
      {R"("children": [1])", R"("children": [3])", "/nodes/0/children/0: must be the index"},
      {R"("rotation": [0, 0, 1, 0])", R"("rotation": [0, 0, 0, 0])",
       "/nodes/1/rotation: must be a quaternion of length 1"},
      {R"("modalModels": [)", R"("modalModels": [0, )", model + ": must be an object"},
      {R"("accessors": [)", R"("accessors": 0, "a~/b": [)",
       extension + "/acousticSurfaces/1/profile: is accessor 5, and there are 0"}};
  for (const Fault& fault : faults)
    EXPECT_THAT(refusal(bellWith(fault.before, fault.after)),
                StartsWith("x.gltf: " + fault.message))
        << fault.after;
}

TEST(GltfAudio, RefusesWhatIsNoGltf) {
  for (const std::string text : {"", "{", "[]", "null", "solid cube", "{} {}"})
    EXPECT_THAT(refusal(text), HasSubstr("is no glTF: expected a JSON object")) << text;
  EXPECT_THAT(refusal("{}"), HasSubstr("/asset/version: must be"));
  EXPECT_THAT(refusal("{\n  \"asset\": }"), HasSubstr("(line 2, column 12: this is not JSON: "));
  EXPECT_THAT(refusal(bellText().substr(0, 1000)), HasSubstr("is no glTF"));
}

// The glTF 2.0 specification, under JSON Encoding: names within an object are unique.
TEST(GltfAudio, RefusesADocumentWhoseKeysAppearTwice) {
  EXPECT_THAT(refusal(R"({"asset": {"version": "2.0", "version": "2.0"}})"),
              HasSubstr("/asset/version: the key \"version\" appears twice"));
}

TEST(GltfAudio, RefusesADocumentThatIsNestedWithoutEnd) {
  EXPECT_THAT(refusal(R"({"extras": )" + std::string(100'000, '[')), HasSubstr("nested too deep"));
}

TEST(GltfAudio, RefusesGlbFilesThatAreNotWhole) {
  const TemporaryFolder folder;
  ASSERT_TRUE(writeGltfAudio(folder / "a.glb", bell()));
  const std::string whole = contents(folder / "a.glb");
  for (std::size_t size = 0; size < whole.size(); size += 7)
    EXPECT_NE(refusal(whole.substr(0, size)), "") << size;
  const auto with = [&whole](std::size_t at, char byte) {
    std::string file = whole;
    file[at] = byte;
    return refusal(file);
  };
  EXPECT_THAT(with(4, 1), HasSubstr("is a GLB file of version 1; expected version 2"));
  EXPECT_THAT(with(11, 1), HasSubstr("and has " + std::to_string(whole.size())));
  EXPECT_THAT(with(15, 1), HasSubstr("has no JSON as its first chunk, or one longer"));
  EXPECT_THAT(with(16, 'X'), HasSubstr("has no JSON as its first chunk"));
}

TEST(GltfAudio, WritesNothingThatTheDraftRefuses) {
  const TemporaryFolder folder;
  GltfAudio audio = bell();
  EXPECT_FALSE(writeGltfAudio(folder / "a.obj", audio));
  audio.models[0].frequencies[1] = std::numeric_limits<float>::infinity();
  const auto written = writeGltfAudio(folder / "a.gltf", audio);
  ASSERT_FALSE(written);
  EXPECT_THAT(written.error().message, HasSubstr("/modalModels/0/frequencies: must be positive"));
  EXPECT_EQ(folder.entries(), 0u);
}

}  // namespace
}  // namespace carom::test
