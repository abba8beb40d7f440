#include "modal/gltf/gltf_builder.h"

#include <algorithm>
#include <utility>

#include "modal/gltf/gltf_format.h"

namespace carom::modal {

std::string toBase64(std::span<const std::byte> bytes) {
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t at = 0; at < bytes.size(); at += 3) {
    const std::size_t present = std::min<std::size_t>(3, bytes.size() - at);
    std::uint32_t group = 0;
    for (std::size_t byte = 0; byte < 3; ++byte)
      group = group << 8U | (byte < present ? std::to_integer<std::uint32_t>(bytes[at + byte]) : 0);
    for (std::size_t digit = 0; digit < 4; ++digit)
      text += digit <= present ? kBase64[group >> (18 - 6 * digit) & 63U] : '=';
  }
  return text;
}

std::size_t GltfBuilder::scalars(std::span<const float> values) {
  return accessor(std::as_bytes(values), values.size(), "SCALAR", kFloat);
}

std::size_t GltfBuilder::vectors(std::span<const Eigen::Vector3f> values) {
  static_assert(sizeof(Eigen::Vector3f) == 3 * sizeof(float));
  return accessor(std::as_bytes(values), values.size(), "VEC3", kFloat);
}

std::size_t GltfBuilder::indices(std::span<const std::uint32_t> values) {
  return accessor(std::as_bytes(values), values.size(), "SCALAR", kUnsignedInt);
}

/// All components that are written have four bytes, so everything stays aligned.
std::size_t GltfBuilder::accessor(std::span<const std::byte> bytes, std::size_t count,
                                  const char* type, std::size_t componentType) {
  const std::size_t index = accessors_.size();
  bufferViews_.push_back(
      {{"buffer", 0}, {"byteOffset", buffer_.size()}, {"byteLength", bytes.size()}});
  accessors_.push_back(
      {{"bufferView", index}, {"componentType", componentType}, {"count", count}, {"type", type}});
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  return index;
}

std::string GltfBuilder::text(Json json, bool embedded) const {
  json["asset"] = {{"version", "2.0"}, {"generator", "carom"}};
  if (!buffer_.empty()) {
    json["accessors"] = accessors_;
    json["bufferViews"] = bufferViews_;
    Json buffer = {{"byteLength", buffer_.size()}};
    if (embedded) buffer["uri"] = "data:application/octet-stream;base64," + toBase64(buffer_);
    json["buffers"] = Json::array({buffer});
  }
  // A name that is no UTF-8 is no reason to fail: its invalid bytes are replaced.
  return json.dump(embedded ? 2 : -1, ' ', false, Json::error_handler_t::replace);
}

std::vector<std::byte> GltfBuilder::gltf(Json json) const {
  const std::string file = text(std::move(json), true) + '\n';
  const auto bytes = std::as_bytes(std::span(file));
  return {bytes.begin(), bytes.end()};
}

std::vector<std::byte> GltfBuilder::glb(Json json) const {
  std::string content = text(std::move(json), false);
  content.resize((content.size() + kWord - 1) / kWord * kWord, ' ');
  std::vector<std::byte> file;
  const auto word = [&file](std::size_t value) {
    for (unsigned shift = 0; shift < 32; shift += 8)
      file.push_back(static_cast<std::byte>(value >> shift & 0xFFU));
  };
  const auto chunk = [&](std::span<const std::byte> bytes, std::uint32_t type) {
    word(bytes.size());
    word(type);
    file.insert(file.end(), bytes.begin(), bytes.end());
  };
  word(kGlbMagic);
  word(2);
  word(kGlbHeaderSize + kChunkHeaderSize + content.size() +
       (buffer_.empty() ? 0 : kChunkHeaderSize + buffer_.size()));
  chunk(std::as_bytes(std::span(content)), kJsonChunk);
  if (!buffer_.empty()) chunk(buffer_, kBinChunk);
  return file;
}

}  // namespace carom::modal
