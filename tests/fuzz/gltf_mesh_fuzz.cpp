#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "carom/modal/mesh_file.h"
#include "tests/fuzz/fuzz_numbers.h"

namespace carom::fuzz {
namespace {

using nlohmann::json;

constexpr int kFloat = 5126;

/// Makes a glTF file that is valid but for the numbers in it, of which any may be wild: counts,
/// offsets, strides, types, indices, transforms, the tree of nodes.
class GltfMaker {
 public:
  explicit GltfMaker(FuzzNumbers& numbers) : numbers_(numbers) {}

  /// The file, as .glb or as .gltf with its data in it.
  std::string make(bool isBinary) {
    const std::size_t meshes = 1 + numbers_.below(2);
    for (std::size_t index = 0; index < meshes; ++index)
      addMesh();
    addNodes(meshes);
    if (numbers_.rarely(64)) addOddities();
    file_["asset"] = {{"version", "2.0"}};
    json buffer = {{"byteLength", wildCount(data_.size())}};
    if (!isBinary) buffer["uri"] = "data:application/octet-stream;base64," + base64();
    file_["buffers"] = json::array({buffer});
    const std::string text = file_.dump(-1, ' ', false, json::error_handler_t::replace);
    return isBinary ? binary(text) : text;
  }

 private:
  json wildCount(std::size_t sound) {
    constexpr std::array<std::int64_t, 9> kWild = {0,          1,          -1, 65535,     65536,
                                                   1LL << 31U, 1LL << 32U, 3,  1LL << 62U};
    const std::uint8_t choice = numbers_.byte();
    if (choice >= 252) return numbers_.wild(0.5);
    return choice < 236 ? json(sound) : json(kWild[(choice - 236U) % kWild.size()]);
  }
  /// JSON has no numbers that are not finite: they become null, which is wild enough.
  json wildNumbers(std::size_t count, double around) {
    json list = json::array();
    for (std::size_t index = 0; index < count; ++index)
      list.push_back(numbers_.wild(around + numbers_.between(-2.0, 2.0)));
    return list;
  }

  template <class Number>
  std::size_t append(const std::vector<Number>& values) {
    while (data_.size() % 4 != 0)
      data_.push_back('\0');
    const std::size_t at = data_.size();
    const std::span bytes = std::as_bytes(std::span(values));
    data_.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    return at;
  }
  std::size_t addView(std::size_t at, std::size_t length) {
    json view = {
        {"buffer", wildCount(0)}, {"byteOffset", wildCount(at)}, {"byteLength", wildCount(length)}};
    if (numbers_.rarely(24)) view["byteStride"] = wildCount(4 * numbers_.below(16));
    file_["bufferViews"].push_back(view);
    return file_["bufferViews"].size() - 1;
  }
  /// An accessor of what lies in a view, perhaps with some elements replaced (sparse).
  json addAccessor(json accessor) {
    if (numbers_.rarely(24)) accessor["byteOffset"] = wildCount(4 * numbers_.below(4));
    if (numbers_.rarely(24)) addSparse(accessor);
    if (numbers_.rarely(4)) accessor.erase("bufferView");
    file_["accessors"].push_back(accessor);
    return wildCount(file_["accessors"].size() - 1);
  }
  void addSparse(json& accessor) {
    const std::size_t count = numbers_.below(4);
    std::vector<std::uint32_t> places;
    for (std::size_t index = 0; index < count; ++index)
      places.push_back(numbers_.chance(240) ? static_cast<std::uint32_t>(index) : 0x7fffffffU);
    const std::vector<float> values(3 * count, 0.5F);
    accessor["sparse"] = {
        {"count", wildCount(count)},
        {"indices",
         {{"bufferView", wildCount(addView(append(places), 4 * count))}, {"componentType", 5125}}},
        {"values", {{"bufferView", wildCount(addView(append(values), 12 * count))}}}};
  }
  json addPositions(std::size_t count) {
    std::vector<float> values;
    for (std::size_t index = 0; index < 3 * count; ++index) {
      const double number = numbers_.wild(numbers_.between(-1.0, 1.0));
      values.push_back(std::abs(number) < 3e38 ? static_cast<float>(number) : HUGE_VALF);
    }
    return addAccessor({{"bufferView", wildCount(addView(append(values), 12 * count))},
                        {"componentType", numbers_.rarely(8) ? 5120 + numbers_.byte() % 8 : kFloat},
                        {"count", wildCount(count)},
                        {"type", typeOr("VEC3")}});
  }
  std::string typeOr(const char* sound) {
    constexpr std::array kTypes = {"SCALAR", "VEC2", "VEC3", "VEC4", "MAT4", "none"};
    return numbers_.rarely(8) ? kTypes[numbers_.below(kTypes.size())] : sound;
  }
  template <class Index>
  json addIndices(std::size_t triangles, std::size_t vertices, int type) {
    std::vector<Index> values;
    for (std::size_t index = 0; index < 3 * triangles; ++index) {
      const std::size_t vertex = numbers_.below(vertices);
      values.push_back(static_cast<Index>(numbers_.chance(250) ? vertex : ~std::size_t{0}));
    }
    return addAccessor(
        {{"bufferView", wildCount(addView(append(values), sizeof(Index) * values.size()))},
         {"componentType", numbers_.rarely(8) ? 5120 + numbers_.byte() % 8 : type},
         {"count", wildCount(values.size())},
         {"type", typeOr("SCALAR")}});
  }
  json addIndices(std::size_t triangles, std::size_t vertices) {
    switch (numbers_.below(3)) {
      case 0:
        return addIndices<std::uint8_t>(triangles, vertices, 5121);
      case 1:
        return addIndices<std::uint16_t>(triangles, vertices, 5123);
      default:
        return addIndices<std::uint32_t>(triangles, vertices, 5125);
    }
  }
  void addMesh() {
    const std::size_t vertices = 3 + numbers_.below(12);
    vertices_.push_back(vertices);
    json primitive = {{"attributes", {{"POSITION", addPositions(vertices)}}}};
    if (numbers_.chance(200)) primitive["indices"] = addIndices(1 + numbers_.below(8), vertices);
    if (numbers_.rarely(48)) primitive["mode"] = wildCount(numbers_.below(7));
    if (numbers_.rarely(32)) primitive["attributes"]["NORMAL"] = addPositions(vertices);
    if (numbers_.rarely(32)) primitive["attributes"]["TEXCOORD_0"] = addPositions(vertices);
    if (numbers_.rarely(16)) primitive["attributes"]["JOINTS_0"] = addPositions(vertices);
    if (numbers_.rarely(32))
      primitive["targets"] = json::array({{{"POSITION", addPositions(vertices)}}});
    if (numbers_.rarely(16)) primitive["material"] = wildCount(0);
    file_["meshes"].push_back({{"primitives", json::array({primitive})}});
  }
  void addNodes(std::size_t meshes) {
    const std::size_t count = 1 + numbers_.below(4);
    for (std::size_t index = 0; index < count; ++index) {
      json node = {{"mesh", wildCount(index % meshes)}};
      switch (numbers_.below(4)) {
        case 0:
          node["matrix"] = wildNumbers(numbers_.rarely(8) ? 3 : 16, 0.0);
          break;
        case 1:
          node["translation"] = wildNumbers(3, 0.0);
          node["rotation"] = wildNumbers(numbers_.rarely(8) ? 2 : 4, 0.0);
          node["scale"] = wildNumbers(3, 1.0);
          break;
        default:
          break;
      }
      if (index + 1 < count && numbers_.chance(192)) node["children"] = {wildCount(index + 1)};
      if (numbers_.rarely(4)) node["children"] = {numbers_.below(count)};
      if (numbers_.rarely(8)) node["skin"] = wildCount(0);
      file_["nodes"].push_back(node);
    }
    file_["scenes"] = json::array({{{"nodes", json::array({wildCount(0)})}}});
    file_["scene"] = wildCount(0);
  }

  /// Adds a second set of coordinates and extensions, or leaves parts out. This draws from the
  /// bytes last, so that older inputs keep their meaning.
  void addOddities() {
    const std::size_t which = numbers_.below(file_["meshes"].size());
    json& attributes = file_["meshes"][which]["primitives"][0]["attributes"];
    if (numbers_.chance(128)) attributes["TEXCOORD_0"] = addPairs(vertices_[which]);
    if (numbers_.rarely(32)) attributes.erase("POSITION");
    if (numbers_.rarely(32)) file_.erase("scene");
    if (numbers_.rarely(16)) file_.erase("scenes");
    constexpr std::array kNames = {"KHR_draco_mesh_compression", "EXT_meshopt_compression",
                                   "KHR_texture_transform"};
    if (numbers_.rarely(48))
      file_["extensionsRequired"] = json::array({kNames[numbers_.below(kNames.size())]});
  }
  json addPairs(std::size_t count) {
    if (numbers_.rarely(32)) ++count;
    const std::vector<float> values(2 * count, 0.25F);
    return addAccessor({{"bufferView", wildCount(addView(append(values), 8 * count))},
                        {"componentType", numbers_.rarely(16) ? 5121 : kFloat},
                        {"count", wildCount(count)},
                        {"type", typeOr("VEC2")}});
  }

  std::string base64() const {
    constexpr std::string_view kDigits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (std::size_t at = 0; at < data_.size(); at += 3) {
      std::uint32_t three = 0;
      for (std::size_t index = at; index < at + 3; ++index)
        three = three << 8U |
                (index < data_.size() ? static_cast<std::uint8_t>(data_[index]) : std::uint8_t{0});
      for (unsigned digit = 0; digit < 4; ++digit)
        text += at + digit <= data_.size() ? kDigits[three >> (18U - 6U * digit) & 63U] : '=';
    }
    return text;
  }
  static void appendLittleEndian(std::string& to, std::size_t value) {
    for (unsigned shift = 0; shift < 32; shift += 8)
      to += static_cast<char>(value >> shift & 255U);
  }
  std::string binary(std::string text) {
    text.resize((text.size() + 3) / 4 * 4, ' ');
    std::string data = data_;
    data.resize((data.size() + 3) / 4 * 4, '\0');
    std::string whole = "glTF";
    appendLittleEndian(whole, 2);
    appendLittleEndian(whole, 28 + text.size() + data.size());
    appendLittleEndian(whole, numbers_.rarely(2) ? 0x7fffffffU : text.size());
    whole += "JSON" + text;
    appendLittleEndian(whole, numbers_.rarely(2) ? 0x7fffffffU : data.size());
    whole += std::string("BIN\0", 4) + data;
    return whole;
  }

  FuzzNumbers& numbers_;
  json file_;
  std::vector<std::size_t> vertices_;  // of each mesh
  std::string data_;
};

void read(FuzzNumbers& numbers) {
  const bool isBinary = numbers.chance(128);
  const std::string file = GltfMaker(numbers).make(isBinary);
  const char* name = isBinary ? "fuzz.glb" : "fuzz.gltf";
  const auto loaded = meshFromBytes(std::as_bytes(std::span(file)), name);
  if (!loaded) {
    const std::string_view message = loaded.error().message;
    require(message.starts_with("mesh file 'fuzz.gl") && message.size() < 1000);
    return;
  }
  require(!loaded->surface.triangles.empty());
  for (const Vec3& vertex : loaded->surface.vertices)
    require(vertex.allFinite());
  for (const auto& triangle : loaded->surface.triangles)
    for (const std::uint32_t corner : triangle)
      require(corner < loaded->surface.vertices.size());
}

}  // namespace
}  // namespace carom::fuzz

/// Reads a glTF file that the bytes stand for, valid but for its numbers: a sound surface or one
/// sentence with the file's name must come of it, behind Assimp too.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  carom::fuzz::FuzzNumbers numbers({data, size});
  carom::fuzz::read(numbers);
  return 0;
}
