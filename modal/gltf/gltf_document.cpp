#include "modal/gltf/gltf_document.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>

#include "audio/io/byte_file.h"

namespace carom::modal {

using namespace audio;

namespace fs = std::filesystem;

namespace {

// glTF and GLB are little-endian, and so is all that this project is built on; a float and an
// integer are copied as they are.
static_assert(std::endian::native == std::endian::little);

constexpr std::size_t kUnsignedShort = 5123;
constexpr std::size_t kUnsignedInt = 5125;
constexpr std::size_t kFloat = 5126;

constexpr std::uint32_t kGlbMagic = 0x46546C67;   // "glTF"
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;  // "JSON"
constexpr std::uint32_t kBinChunk = 0x004E4942;   // "BIN\0"
constexpr std::size_t kGlbHeaderSize = 12;
constexpr std::size_t kChunkHeaderSize = 8;
constexpr std::size_t kWord = 4;  ///< bytes; the alignment of glTF

/// Limit of the bytes of all accessors together, as many may show the same bytes.
constexpr std::size_t kMostBytes = std::size_t{1} << 30U;

constexpr std::string_view kBase64 =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

const Json& nothing() {
  static const Json null;
  return null;
}

std::uint32_t wordAt(std::span<const std::byte> bytes, std::size_t at) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.subspan(at, sizeof word).data(), sizeof word);
  return word;
}

/// Returns a key as part of a JSON pointer (RFC 6901).
std::string escaped(const std::string& key) {
  std::string text;
  for (const char letter : key) {
    if (letter == '~')
      text += "~0";
    else if (letter == '/')
      text += "~1";
    else
      text += letter;
  }
  return text;
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

bool JsonView::has(const std::string& key) const {
  return value_->is_object() && value_->contains(key);
}

JsonView JsonView::member(const std::string& key) const {
  const std::string pointer = pointer_ + '/' + escaped(key);
  if (!value_->is_object() && !value_->is_null()) refuse("must be an object");
  if (!value_->is_object()) return {nothing(), pointer, *fault_};
  const auto found = value_->find(key);
  return {found == value_->end() ? nothing() : *found, pointer, *fault_};
}

std::vector<JsonView> JsonView::elements() const {
  std::vector<JsonView> views;
  if (!value_->is_array() && !value_->is_null()) refuse("must be an array");
  if (!value_->is_array()) return views;
  for (const Json& element : *value_)
    views.emplace_back(element, pointer_ + '/' + std::to_string(views.size()), *fault_);
  return views;
}

JsonView JsonView::element(const JsonView& reference, const std::string& kind) const {
  const std::size_t index = reference.index();
  const std::size_t size = value_->is_array() ? value_->size() : 0;
  if (index >= size)
    reference.refuse("is " + kind + ' ' + std::to_string(index) + ", and there are " +
                     std::to_string(size));
  return {index < size ? (*value_)[index] : nothing(), pointer_ + '/' + std::to_string(index),
          *fault_};
}

bool JsonView::isTrue(const std::string& key) const {
  return has(key) && *member(key).value_ == true;
}

double JsonView::number() const {
  if (!value_->is_number()) {
    refuse("must be a number");
    return 0.0;
  }
  return value_->get<double>();
}

std::size_t JsonView::index() const {
  if (!value_->is_number_unsigned()) {
    refuse("must be an integer from 0");
    return 0;
  }
  return value_->get<std::size_t>();
}

std::string JsonView::text() const {
  if (!value_->is_string()) {
    refuse("must be a string");
    return {};
  }
  return value_->get<std::string>();
}

double JsonView::number(const std::string& key, double absent) const {
  return has(key) ? member(key).number() : absent;
}

std::optional<double> JsonView::numberIf(const std::string& key) const {
  if (!has(key)) return std::nullopt;
  return member(key).number();
}

std::size_t JsonView::index(const std::string& key, std::size_t absent) const {
  return has(key) ? member(key).index() : absent;
}

std::optional<std::size_t> JsonView::indexIf(const std::string& key) const {
  if (!has(key)) return std::nullopt;
  return member(key).index();
}

std::string JsonView::text(const std::string& key) const {
  return has(key) ? member(key).text() : std::string();
}

void JsonView::numbers(const std::string& key, std::span<double> values) const {
  if (!has(key)) return;
  const JsonView array = member(key);
  const std::vector<JsonView> elements = array.elements();
  if (elements.size() != values.size())
    return array.refuse("must be an array of " + std::to_string(values.size()) + " numbers");
  for (std::size_t at = 0; at < values.size(); ++at)
    values[at] = elements[at].number();
}

void JsonView::refuse(const std::string& why) const {
  if (fault_->empty()) *fault_ = (pointer_.empty() ? "/" : pointer_) + ": " + why;
}

Result<GltfDocument> GltfDocument::parse(std::span<const std::byte> bytes, const fs::path& folder) {
  GltfDocument document;
  document.folder_ = folder;
  std::span<const std::byte> text = bytes;
  if (bytes.size() >= kWord && wordAt(bytes, 0) == kGlbMagic) {
    const Result<GlbChunks> chunks = glbChunks(bytes);
    if (!chunks) return chunks.error();
    text = chunks->json;
    if (chunks->binary)
      document.binaryChunk_.emplace(chunks->binary->begin(), chunks->binary->end());
  }
  const char* begin = reinterpret_cast<const char*>(text.data());
  document.json_ = Json::parse(begin, begin + text.size(), nullptr, false);
  if (!document.json_.is_object())
    return Error{"is no glTF: expected a JSON object, or a GLB file with one"};
  const JsonView asset = document.root().member("asset");
  if (!asset.text("version").starts_with("2."))
    asset.member("version").refuse("must be \"2.0\": glTF of another version is not read");
  if (!document.fault().empty()) return Error{document.fault()};
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
void GltfDocument::checkKind(const JsonView& accessor, std::string_view type,
                             std::span<const std::size_t> componentTypes) {
  if (accessor.text("type") != type)
    accessor.member("type").refuse("must be \"" + std::string(type) + '"');
  const std::size_t componentType = accessor.index("componentType", 0);
  if (std::ranges::find(componentTypes, componentType) == componentTypes.end())
    accessor.member("componentType")
        .refuse(componentTypes.front() == kFloat
                    ? "must be 5126, floats; the extension has no normalised integers"
                    : "must be 5125 or 5123, unsigned integers");
  if (accessor.isTrue("normalized"))
    accessor.member("normalized").refuse("must be false: the extension has no normalised integers");
  if (accessor.has("sparse"))
    accessor.member("sparse").refuse("is not read here; write the accessor out in full");
  if (!accessor.has("bufferView"))
    accessor.member("bufferView").refuse("is missing; an accessor of zeros is not read here");
  if (accessor.index("count", 0) == 0) accessor.member("count").refuse("must be an integer from 1");
}

GltfDocument::Elements GltfDocument::elementsOf(const JsonView& reference, std::string_view type,
                                                std::span<const std::size_t> componentTypes) {
  const JsonView accessor = root().member("accessors").element(reference, "accessor");
  checkKind(accessor, type, componentTypes);
  const JsonView view =
      root().member("bufferViews").element(accessor.member("bufferView"), "buffer view");
  const std::span<const std::byte> bytes = bytesOf(view);
  if (!fault_.empty()) return {};

  Elements elements;
  elements.count = accessor.index("count", 0);
  elements.componentType = accessor.index("componentType", 0);
  const std::size_t component = elements.componentType == kUnsignedShort ? 2 : 4;
  const std::size_t size = component * (type == "VEC3" ? 3 : 1);
  elements.stride = view.index("byteStride", size);
  const std::size_t offset = accessor.index("byteOffset", 0);
  if (elements.stride < size) view.member("byteStride").refuse("is less than one element takes");
  const bool fits =
      offset <= bytes.size() && size <= bytes.size() - offset &&
      (elements.count - 1) <= (bytes.size() - offset - size) / std::max(elements.stride, size);
  if (!fits) accessor.refuse("reaches beyond its buffer view");
  // Elements are counted only if they fit, so that the sum cannot overflow.
  if (fault_.empty() && (bytesRead_ += elements.count * size) > kMostBytes)
    accessor.refuse("is too much: the accessors in use have more than 1 GiB");
  if (!fault_.empty()) return {};
  elements.bytes = bytes.subspan(offset);
  return elements;
}

std::span<const std::byte> GltfDocument::bytesOf(const JsonView& bufferView) {
  const std::span<const std::byte> bytes = bufferOf(bufferView.member("buffer"));
  const std::size_t offset = bufferView.index("byteOffset", 0);
  const std::size_t length = bufferView.index("byteLength", 0);
  if (offset > bytes.size() || length > bytes.size() - offset)
    bufferView.refuse("reaches beyond its buffer");
  return fault_.empty() ? bytes.subspan(offset, length) : std::span<const std::byte>();
}

std::span<const std::byte> GltfDocument::bufferOf(const JsonView& reference) {
  const JsonView buffer = root().member("buffers").element(reference, "buffer");
  if (!fault_.empty()) return {};
  const std::size_t which = reference.index();
  if (const auto known = buffers_.find(which); known != buffers_.end()) return known->second;
  std::vector<std::byte> bytes = loadBuffer(which, buffer);
  const std::size_t length = buffer.index("byteLength", 0);
  if (length > bytes.size())
    buffer.member("byteLength")
        .refuse("is " + std::to_string(length) + ", and there are " + std::to_string(bytes.size()) +
                " bytes");
  if (!fault_.empty()) return {};
  bytes.resize(length);
  return buffers_.emplace(which, std::move(bytes)).first->second;
}

std::vector<std::byte> GltfDocument::loadBuffer(std::size_t which, const JsonView& buffer) {
  const JsonView where = buffer.member("uri");
  const auto refused = [&where](const std::string& why) {
    where.refuse(why);
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
  if (!path) return refused("must be base64, or the path of a file below the folder of this one");
  Result<std::vector<std::byte>> bytes = readBytes(folder_ / *path);
  return bytes ? *std::move(bytes) : refused("'" + path->string() + "': " + bytes.error().message);
}

std::vector<float> GltfDocument::scalars(const JsonView& reference) {
  const Elements elements = elementsOf(reference, "SCALAR", std::array{kFloat});
  std::vector<float> values(elements.count);
  for (std::size_t at = 0; at < values.size(); ++at)
    values[at] = elements.number<float>(at, 0);
  return values;
}

std::vector<Eigen::Vector3f> GltfDocument::vectors(const JsonView& reference) {
  const Elements elements = elementsOf(reference, "VEC3", std::array{kFloat});
  std::vector<Eigen::Vector3f> values(elements.count);
  for (std::size_t at = 0; at < values.size(); ++at)
    values[at] = {elements.number<float>(at, 0), elements.number<float>(at, 1),
                  elements.number<float>(at, 2)};
  return values;
}

std::vector<std::uint32_t> GltfDocument::indices(const JsonView& reference) {
  const Elements elements =
      elementsOf(reference, "SCALAR", std::array{kUnsignedInt, kUnsignedShort});
  std::vector<std::uint32_t> values(elements.count);
  for (std::size_t at = 0; at < values.size(); ++at)
    values[at] = elements.componentType == kUnsignedInt ? elements.number<std::uint32_t>(at, 0)
                                                        : elements.number<std::uint16_t>(at, 0);
  return values;
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
