#include "modal/mesh/ply_reader.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "audio/model/decimal.h"

namespace carom::modal {
namespace {

constexpr std::size_t kMaxHeader = 1U << 16;  // bytes

enum class Number { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

struct Property {
  std::string name;
  Number type = Number::float32;
  std::optional<Number> counted;  // lists only: the type of the count
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

enum class Encoding { text, littleEndian, bigEndian };

struct Header {
  Encoding encoding = Encoding::text;
  std::vector<Element> elements;
};

std::optional<Number> numberOf(std::string_view name) {
  static constexpr std::array<std::pair<std::string_view, Number>, 16> kNames = {{
      {"char", Number::int8},
      {"int8", Number::int8},
      {"uchar", Number::uint8},
      {"uint8", Number::uint8},
      {"short", Number::int16},
      {"int16", Number::int16},
      {"ushort", Number::uint16},
      {"uint16", Number::uint16},
      {"int", Number::int32},
      {"int32", Number::int32},
      {"uint", Number::uint32},
      {"uint32", Number::uint32},
      {"float", Number::float32},
      {"float32", Number::float32},
      {"double", Number::float64},
      {"float64", Number::float64},
  }};
  for (const auto& [known, number] : kNames)
    if (known == name) return number;
  return std::nullopt;
}

// ---- header

bool readFormat(std::istringstream& words, Header& header) {
  std::string encoding;
  words >> encoding;
  if (encoding == "ascii") {
    header.encoding = Encoding::text;
  } else if (encoding == "binary_little_endian") {
    header.encoding = Encoding::littleEndian;
  } else if (encoding == "binary_big_endian") {
    header.encoding = Encoding::bigEndian;
  } else {
    return false;
  }
  return true;
}

bool readElement(std::istringstream& words, Header& header) {
  Element element;
  words >> element.name >> element.count;
  header.elements.push_back(std::move(element));
  return !words.fail();
}

bool readProperty(std::istringstream& words, Header& header) {
  Property property;
  std::string type;
  words >> type;
  if (type == "list") {
    std::string count;
    words >> count >> type;
    property.counted = numberOf(count);
    if (!property.counted) return false;
  }
  words >> property.name;
  const std::optional<Number> number = numberOf(type);
  if (!number || words.fail() || header.elements.empty()) return false;
  property.type = *number;
  header.elements.back().properties.push_back(std::move(property));
  return true;
}

/// Takes the header off the front of `bytes`.
Result<Header> readHeader(std::span<const std::byte>& bytes) {
  // Bytes may be looked at as characters.
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()),
                              std::min(bytes.size(), kMaxHeader));
  Header header;
  std::size_t line = 1;
  bool hasFormat = false;
  for (std::size_t from = 0; from < text.size(); ++line) {
    const std::size_t end = text.find('\n', from);
    if (end == std::string_view::npos) break;
    std::istringstream words{std::string(text.substr(from, end - from))};
    from = end + 1;
    std::string keyword;
    words >> keyword;
    bool good = (keyword == "ply") == (line == 1);
    if (keyword == "format") {
      good = good && readFormat(words, header);
      hasFormat = true;
    } else if (keyword == "element") {
      good = good && readElement(words, header);
    } else if (keyword == "property") {
      good = good && readProperty(words, header);
    } else if (keyword == "end_header") {
      if (!good || !hasFormat) return Error{"its header names no format"};
      bytes = bytes.subspan(from);
      return header;
    } else if (keyword != "ply" && keyword != "comment" && keyword != "obj_info") {
      good = false;
    }
    if (!good) return Error{"line " + std::to_string(line) + " of its header is none of PLY"};
  }
  return Error{"its header has no end_header"};
}

// ---- data

std::size_t sizeOf(Number type) {
  switch (type) {
    case Number::int8:
    case Number::uint8:
      return 1;
    case Number::int16:
    case Number::uint16:
      return 2;
    case Number::float64:
      return 8;
    default:
      return 4;
  }
}

/// Reads the numbers after the header, one by one; nothing at the end of the data, or for text that
/// is no number.
class Numbers {
 public:
  Numbers(std::span<const std::byte> bytes, Encoding encoding)
      : bytes_(bytes), encoding_(encoding) {}

  std::size_t bytesLeft() const { return bytes_.size(); }

  std::optional<double> next(Number type) {
    return encoding_ == Encoding::text ? nextText() : nextBinary(type);
  }

 private:
  std::optional<double> nextText() {
    const auto* at = reinterpret_cast<const char*>(bytes_.data());
    const char* end = at + bytes_.size();
    while (at != end && (*at == ' ' || *at == '\t' || *at == '\n' || *at == '\r'))
      ++at;
    if (at != end && *at == '+') ++at;
    double value = 0.0;
    const auto [past, code] = audio::readDecimal(at, end, value);
    if (code == std::errc::invalid_argument) return std::nullopt;
    bytes_ = bytes_.last(static_cast<std::size_t>(end - past));
    return code == std::errc() ? value : outOfRange(at, past);
  }

  /// Value of a number outside the range of a double: 0 if it is too small, infinity if it is too
  /// large.
  static double outOfRange(const char* at, const char* past) {
    const bool small = std::string_view(at, past).find('-', 1) != std::string_view::npos;
    return small ? 0.0 : std::numeric_limits<double>::infinity();
  }

  std::optional<double> nextBinary(Number type) {
    switch (type) {
      case Number::int8:
        return take<std::int8_t>();
      case Number::uint8:
        return take<std::uint8_t>();
      case Number::int16:
        return take<std::int16_t>();
      case Number::uint16:
        return take<std::uint16_t>();
      case Number::int32:
        return take<std::int32_t>();
      case Number::uint32:
        return take<std::uint32_t>();
      case Number::float32:
        return take<float>();
      case Number::float64:
        return take<double>();
    }
    return std::nullopt;
  }

  template <class Type>
  std::optional<double> take() {
    if (bytes_.size() < sizeof(Type)) return std::nullopt;
    std::array<std::byte, sizeof(Type)> raw{};
    std::ranges::copy(bytes_.first(sizeof(Type)), raw.begin());
    bytes_ = bytes_.subspan(sizeof(Type));
    const bool little = encoding_ == Encoding::littleEndian;
    if (little != (std::endian::native == std::endian::little)) std::ranges::reverse(raw);
    return static_cast<double>(std::bit_cast<Type>(raw));
  }

  std::span<const std::byte> bytes_;
  Encoding encoding_;
};

std::optional<std::size_t> whole(double value) {
  if (!(value >= 0.0 && value <= std::numeric_limits<std::uint32_t>::max())) return std::nullopt;
  if (value != std::floor(value)) return std::nullopt;
  return static_cast<std::size_t>(value);
}

/// The destination of a value: a coordinate in space or in the texture, the corners of a polygon,
/// or none.
enum class Role { none, x, y, z, u, v, corners };

Role roleOfVertex(std::string_view name) {
  // Texture coordinates are named in one of three ways.
  constexpr std::array<std::pair<std::string_view, Role>, 9> kNames = {{{"x", Role::x},
                                                                        {"y", Role::y},
                                                                        {"z", Role::z},
                                                                        {"u", Role::u},
                                                                        {"v", Role::v},
                                                                        {"s", Role::u},
                                                                        {"t", Role::v},
                                                                        {"texture_u", Role::u},
                                                                        {"texture_v", Role::v}}};
  const auto isNamed = [name](const auto& one) { return one.first == name; };
  const auto found = std::ranges::find_if(kNames, isNamed);
  return found == kNames.end() ? Role::none : found->second;
}

struct Vertex {
  Vec3 position = Vec3::Zero();
  Vec2 coordinates = Vec2::Zero();
};

class Reader {
 public:
  Reader(const Header& header, std::span<const std::byte> data)
      : header_(header), numbers_(data, header.encoding) {}

  Result<PolygonMesh> read() {
    mesh_.meshes = 1;
    for (const Element& element : header_.elements)
      if (std::string reason = readElement(element); !reason.empty()) return Error{reason};
    if (mesh_.coordinates.size() != mesh_.vertices.size()) mesh_.coordinates.clear();
    return std::move(mesh_);
  }

 private:
  static Role roleOf(const Element& element, const Property& property) {
    if (element.name == "vertex" && !property.counted) return roleOfVertex(property.name);
    const bool named = property.name == "vertex_indices" || property.name == "vertex_index";
    return element.name == "face" && property.counted && named ? Role::corners : Role::none;
  }

  /// Least size (bytes) of an element; in text, of at least one character for each property.
  std::size_t leastSize(const Element& element) const {
    std::size_t size = 0;
    for (const Property& property : element.properties)
      size +=
          header_.encoding == Encoding::text ? 1 : sizeOf(property.counted.value_or(property.type));
    return size;
  }

  std::string readElement(const Element& element) {
    const std::size_t least = leastSize(element);
    if (least == 0) return "";
    // Checked first, so that no time or memory is spent on elements that are not there.
    if (element.count > numbers_.bytesLeft() / least) return tooShort(element, 0);
    std::vector<Role> roles;
    for (const Property& property : element.properties)
      roles.push_back(roleOf(element, property));
    const bool hasCoordinates = std::ranges::find(roles, Role::u) != roles.end() &&
                                std::ranges::find(roles, Role::v) != roles.end();
    for (std::uint64_t row = 0; row < element.count; ++row) {
      Vertex vertex;
      for (std::size_t index = 0; index < roles.size(); ++index) {
        std::string reason = readProperty(element.properties[index], roles[index], vertex);
        if (reason == kEnd) return tooShort(element, row);
        if (!reason.empty()) return element.name + " " + std::to_string(row) + " " + reason;
      }
      if (element.name == "vertex") mesh_.vertices.push_back(vertex.position);
      if (hasCoordinates) mesh_.coordinates.push_back(vertex.coordinates);
    }
    return "";
  }

  static std::string tooShort(const Element& element, std::uint64_t row) {
    return "it ends, or goes on with something that is no number, in " + element.name + " " +
           std::to_string(row) + " of " + std::to_string(element.count);
  }

  std::string readProperty(const Property& property, Role role, Vertex& vertex) {
    if (property.counted) return readList(property, role);
    const std::optional<double> value = numbers_.next(property.type);
    if (!value) return kEnd;
    if (role == Role::x) vertex.position.x() = *value;
    if (role == Role::y) vertex.position.y() = *value;
    if (role == Role::z) vertex.position.z() = *value;
    if (role == Role::u) vertex.coordinates.x() = *value;
    if (role == Role::v) vertex.coordinates.y() = *value;
    return "";
  }

  std::string readList(const Property& property, Role role) {
    const std::optional<double> stated = numbers_.next(*property.counted);
    if (!stated) return kEnd;
    const std::optional<std::size_t> count = whole(*stated);
    if (!count) return "has a list whose length is no whole number from 0 on";
    if (role == Role::corners && *count > kMostCorners)
      return "has " + std::to_string(*count) + " corners; expected at most " +
             std::to_string(kMostCorners);
    for (std::size_t item = 0; item < *count; ++item) {
      const std::optional<double> value = numbers_.next(property.type);
      if (!value) return kEnd;
      if (role != Role::corners) continue;
      const std::optional<std::size_t> vertex = whole(*value);
      if (!vertex) return "has a corner that is no whole number from 0 on";
      mesh_.corners.push_back(static_cast<std::uint32_t>(*vertex));
    }
    if (role == Role::corners) mesh_.endPolygon();
    return "";
  }

  static constexpr const char* kEnd = "end";

  const Header& header_;
  Numbers numbers_;
  PolygonMesh mesh_;
};

}  // namespace

Result<PolygonMesh> readPly(std::span<const std::byte> bytes) {
  const Result<Header> header = readHeader(bytes);
  if (!header) return header.error();
  return Reader(*header, bytes).read();
}

}  // namespace carom::modal
