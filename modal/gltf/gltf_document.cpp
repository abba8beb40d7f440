#include "modal/gltf/gltf_document.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

#include <nlohmann/json.hpp>

#include "audio/io/byte_file.h"
#include "modal/gltf/gltf_format.h"

namespace carom::modal {

using namespace audio;

namespace fs = std::filesystem;

namespace {

/// Limits of a file; models of many nodes are large, but not deep.
constexpr JsonLimits kLimits{.maxDepth = 256, .maxValues = 20'000'000};

/// Limit of the bytes of all accessors together, as many may show the same bytes.
constexpr std::size_t kMostBytes = std::size_t{1} << 30U;

std::uint32_t wordAt(std::span<const std::byte> bytes, std::size_t at) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.subspan(at, sizeof word).data(), sizeof word);
  return word;
}

/// Decodes base64 (RFC 4648, section 4) with its padding; nothing if the text is anything else.
std::optional<std::vector<std::byte>> fromBase64(std::string_view text) {
  if (text.size() % 4 != 0) return std::nullopt;
  const std::size_t padding = text.ends_with("==") ? 2 : text.ends_with("=") ? 1 : 0;
  std::vector<std::byte> bytes;
  bytes.reserve(text.size() / 4 * 3);
  std::uint32_t group = 0;
  for (std::size_t at = 0; at < text.size(); ++at) {
    const bool padded = at + padding >= text.size();
    const std::size_t digit = padded ? 0 : kBase64.find(text[at]);
    if (digit == std::string_view::npos) return std::nullopt;
    group = group << 6U | static_cast<std::uint32_t>(digit);
    if (at % 4 != 3) continue;
    for (const unsigned shift : {16U, 8U, 0U})
      bytes.push_back(static_cast<std::byte>(group >> shift & 0xFFU));
  }
  bytes.resize(bytes.size() - padding);
  return bytes;
}

/// Returns a relative URI as a path (RFC 3986, 2.1); nothing if it is not one of a file below the
/// folder.
std::optional<fs::path> localPath(std::string_view uri) {
  constexpr std::string_view kDigits = "0123456789abcdefABCDEF";
  std::string text;
  for (std::size_t at = 0; at < uri.size(); ++at) {
    if (uri[at] == ':' || uri[at] == '?' || uri[at] == '#') return std::nullopt;
    if (uri[at] != '%') {
      text += uri[at];
      continue;
    }
    if (at + 2 >= uri.size() || kDigits.find(uri[at + 1]) == std::string_view::npos ||
        kDigits.find(uri[at + 2]) == std::string_view::npos)
      return std::nullopt;
    text += static_cast<char>(std::stoi(std::string(uri.substr(at + 1, 2)), nullptr, 16));
    at += 2;
  }
  if (text.empty() || text.find('\0') != std::string::npos) return std::nullopt;
  const fs::path path = text;
  if (path.is_absolute() || std::ranges::find(path, fs::path("..")) != path.end())
    return std::nullopt;
  return path;
}

std::size_t sizeOfComponent(std::size_t type) {
  return type == kUnsignedByte ? 1 : type == kUnsignedShort ? 2 : 4;
}

std::size_t componentsOf(std::string_view type) {
  return type == "VEC3" ? 3 : type == "VEC2" ? 2 : 1;
}

struct GlbChunks {
  std::span<const std::byte> json;
  std::optional<std::span<const std::byte>> binary;
};

Result<GlbChunks> glbChunks(std::span<const std::byte> bytes) {
  if (bytes.size() < kGlbHeaderSize + kChunkHeaderSize)
    return Error{"ends after " + std::to_string(bytes.size()) +
                 " bytes; expected a whole GLB file"};
  if (const std::uint32_t version = wordAt(bytes, 4); version != 2)
    return Error{"is a GLB file of version " + std::to_string(version) + "; expected version 2"};
  const std::size_t length = wordAt(bytes, 8);
  if (length > bytes.size() || length < kGlbHeaderSize + kChunkHeaderSize)
    return Error{"says that it has " + std::to_string(length) + " bytes, and has " +
                 std::to_string(bytes.size())};
  const auto chunkAt = [&](std::size_t at,
                           std::uint32_t type) -> std::optional<std::span<const std::byte>> {
    if (length - at < kChunkHeaderSize || wordAt(bytes, at + 4) != type) return std::nullopt;
    const std::size_t size = wordAt(bytes, at);
    if (size > length - at - kChunkHeaderSize) return std::nullopt;
    return bytes.subspan(at + kChunkHeaderSize, size);
  };
  const auto json = chunkAt(kGlbHeaderSize, kJsonChunk);
  if (!json) return Error{"has no JSON as its first chunk, or one longer than the file"};
  const std::size_t next = kGlbHeaderSize + kChunkHeaderSize + json->size();
  return GlbChunks{*json, chunkAt(next, kBinChunk)};
}

}  // namespace

Result<GltfDocument> GltfDocument::parse(std::span<const std::byte> bytes, std::string_view name,
                                         const fs::path& folder) {
  GltfDocument document(name);
  document.folder_ = folder;
  std::span<const std::byte> text = bytes;
  if (bytes.size() >= kWord && wordAt(bytes, 0) == kGlbMagic) {
    const Result<GlbChunks> chunks = glbChunks(bytes);
    if (!chunks) return Error{std::string(name) + ": " + chunks.error().message};
    text = chunks->json;
    if (chunks->binary)
      document.binaryChunk_.emplace(chunks->binary->begin(), chunks->binary->end());
  }
  FirstError syntax(name);
  auto json = parseJson({reinterpret_cast<const char*>(text.data()), text.size()}, syntax, kLimits);
  if (!json || !json->is_object())
    return Error{std::string(name) +
                 ": is no glTF: expected a JSON object, or a GLB file with one" +
                 (json ? std::string() : " (" + syntax.reason() + ')')};
  document.json_ = std::make_shared<const nlohmann::json>(*std::move(json));
  const JsonNode asset = document.root().member("asset");
  if (!asset.text("version").starts_with("2."))
    asset.member("version").fail("must be \"2.0\": glTF of another version is not read");
  if (document.error()) return document.error().error();
  return document;
}

/// The elements of an accessor, all of them within its buffer.
struct GltfDocument::Elements {
  std::span<const std::byte> bytes;  ///< bytes from the first element on
  std::size_t count = 0;
  std::size_t stride = 0;
  std::size_t componentType = 0;

  /// Returns a component of an element.
  template <class Number>
  Number number(std::size_t element, std::size_t component) const {
    Number value{};
    const std::size_t at = element * stride + component * sizeof value;
    std::memcpy(&value, bytes.subspan(at, sizeof value).data(), sizeof value);
    return value;
  }
};

/// Checks the type and the components, and refuses what this reader leaves to others.
void GltfDocument::checkKind(const JsonNode& accessor, std::string_view type,
                             std::span<const std::size_t> componentTypes) {
  if (accessor.text("type") != type)
    accessor.member("type").fail("must be \"" + std::string(type) + '"');
  const std::size_t componentType = accessor.index("componentType", 0);
  if (std::ranges::find(componentTypes, componentType) == componentTypes.end())
    accessor.member("componentType")
        .fail(componentTypes.front() == kFloat
                  ? "must be 5126, floats; normalised integers are not read here"
              : componentTypes.size() == 2 ? "must be 5125 or 5123, unsigned integers"
                                           : "must be 5125, 5123 or 5121, unsigned integers");
  if (accessor.isTrue("normalized"))
    accessor.member("normalized").fail("must be false: normalised integers are not read here");
  if (accessor.has("sparse"))
    accessor.member("sparse").fail("is not read here; write the accessor out in full");
  if (!accessor.has("bufferView"))
    accessor.member("bufferView").fail("is missing; an accessor of zeros is not read here");
  if (accessor.index("count", 0) == 0) accessor.member("count").fail("must be an integer from 1");
}

GltfDocument::Elements GltfDocument::elementsOf(const JsonNode& reference, std::string_view type,
                                                std::span<const std::size_t> componentTypes) {
  const JsonNode accessor = root().member("accessors").element(reference, "accessor");
  checkKind(accessor, type, componentTypes);
  const JsonNode view =
      root().member("bufferViews").element(accessor.member("bufferView"), "buffer view");
  const std::span<const std::byte> bytes = bytesOf(view);
  if (error_) return {};

  Elements elements;
  elements.count = accessor.index("count", 0);
  elements.componentType = accessor.index("componentType", 0);
  const std::size_t size = sizeOfComponent(elements.componentType) * componentsOf(type);
  elements.stride = view.index("byteStride", size);
  const std::size_t offset = accessor.index("byteOffset", 0);
  if (elements.stride < size) view.member("byteStride").fail("is less than one element takes");
  const bool fits =
      offset <= bytes.size() && size <= bytes.size() - offset &&
      (elements.count - 1) <= (bytes.size() - offset - size) / std::max(elements.stride, size);
  if (!fits) accessor.fail("reaches beyond its buffer view");
  // Elements are counted only if they fit, so that the sum cannot overflow.
  if (!error_ && (bytesRead_ += elements.count * size) > kMostBytes)
    accessor.fail("is too much: the accessors in use have more than 1 GiB");
  if (error_) return {};
  elements.bytes = bytes.subspan(offset);
  return elements;
}

std::span<const std::byte> GltfDocument::bytesOf(const JsonNode& bufferView) {
  const std::span<const std::byte> bytes = bufferOf(bufferView.member("buffer"));
  const std::size_t offset = bufferView.index("byteOffset", 0);
  const std::size_t length = bufferView.index("byteLength", 0);
  if (offset > bytes.size() || length > bytes.size() - offset)
    bufferView.fail("reaches beyond its buffer");
  return !error_ ? bytes.subspan(offset, length) : std::span<const std::byte>();
}

std::span<const std::byte> GltfDocument::bufferOf(const JsonNode& reference) {
  const JsonNode buffer = root().member("buffers").element(reference, "buffer");
  if (error_) return {};
  const std::size_t which = reference.index();
  if (const auto known = buffers_.find(which); known != buffers_.end()) return known->second;
  std::vector<std::byte> bytes = loadBuffer(which, buffer);
  const std::size_t length = buffer.index("byteLength", 0);
  if (length > bytes.size())
    buffer.member("byteLength")
        .fail("is " + std::to_string(length) + ", and there are " + std::to_string(bytes.size()) +
              " bytes");
  if (error_) return {};
  bytes.resize(length);
  return buffers_.emplace(which, std::move(bytes)).first->second;
}

std::vector<std::byte> GltfDocument::loadBuffer(std::size_t which, const JsonNode& buffer) {
  const JsonNode where = buffer.member("uri");
  const auto refused = [&where](const std::string& why) {
    where.fail(why);
    return std::vector<std::byte>();
  };
  if (!buffer.has("uri")) {
    if (which == 0 && binaryChunk_) return *std::exchange(binaryChunk_, std::nullopt);
    return refused("is missing; only the first buffer of a GLB file has its bytes in the file");
  }
  const std::string uri = where.text();
  if (uri.starts_with("data:")) {
    constexpr std::string_view kMark = ";base64,";
    const std::size_t mark = uri.find(kMark);
    if (mark == std::string::npos) return refused("must be base64, if it is a data URI");
    auto bytes = fromBase64(std::string_view(uri).substr(mark + kMark.size()));
    return bytes ? *std::move(bytes) : refused("is no base64");
  }
  if (folder_.empty()) return refused("is of another file, and none is read here");
  const std::optional<fs::path> path = localPath(uri);
  if (!path || !audio::isBelow(folder_ / *path, folder_))
    return refused("must be base64, or the path of a file below the folder of this one, not " +
                   inQuotes(uri));
  Result<std::vector<std::byte>> bytes = readBytes(folder_ / *path);
  return bytes ? *std::move(bytes) : refused("'" + path->string() + "': " + bytes.error().message);
}

std::vector<float> GltfDocument::scalars(const JsonNode& reference) {
  const Elements elements = elementsOf(reference, "SCALAR", std::array{kFloat});
  std::vector<float> values(elements.count);
  for (std::size_t at = 0; at < values.size(); ++at)
    values[at] = elements.number<float>(at, 0);
  return values;
}

std::vector<Eigen::Vector2f> GltfDocument::pairs(const JsonNode& reference) {
  const Elements elements = elementsOf(reference, "VEC2", std::array{kFloat});
  std::vector<Eigen::Vector2f> values(elements.count);
  for (std::size_t at = 0; at < values.size(); ++at)
    values[at] = {elements.number<float>(at, 0), elements.number<float>(at, 1)};
  return values;
}

std::vector<Eigen::Vector3f> GltfDocument::vectors(const JsonNode& reference) {
  const Elements elements = elementsOf(reference, "VEC3", std::array{kFloat});
  std::vector<Eigen::Vector3f> values(elements.count);
  for (std::size_t at = 0; at < values.size(); ++at)
    values[at] = {elements.number<float>(at, 0), elements.number<float>(at, 1),
                  elements.number<float>(at, 2)};
  return values;
}

std::vector<std::uint32_t> GltfDocument::indicesOf(const JsonNode& reference,
                                                   std::span<const std::size_t> componentTypes) {
  const Elements elements = elementsOf(reference, "SCALAR", componentTypes);
  std::vector<std::uint32_t> values(elements.count);
  for (std::size_t at = 0; at < values.size(); ++at)
    values[at] = elements.componentType == kUnsignedInt     ? elements.number<std::uint32_t>(at, 0)
                 : elements.componentType == kUnsignedShort ? elements.number<std::uint16_t>(at, 0)
                                                            : elements.number<std::uint8_t>(at, 0);
  return values;
}

std::vector<std::uint32_t> GltfDocument::indices(const JsonNode& reference) {
  return indicesOf(reference, std::array{kUnsignedInt, kUnsignedShort});
}

std::vector<std::uint32_t> GltfDocument::meshIndices(const JsonNode& reference) {
  return indicesOf(reference, std::array{kUnsignedInt, kUnsignedShort, kUnsignedByte});
}

}  // namespace carom::modal
