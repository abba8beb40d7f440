#include "carom/audio/modal_model_file.h"

#include <algorithm>
#include <bit>
#include <complex>
#include <concepts>
#include <string>
#include <type_traits>

#include "audio/io/byte_file.h"

namespace carom {

using namespace audio;

namespace {

constexpr std::size_t kHeaderSize = kModalModelMagic.size() + sizeof(std::uint32_t);
constexpr std::size_t kChecksumSize = sizeof(std::uint64_t);
constexpr std::size_t kByteBits = 8;
/// The version of the first files that say which part of a mode's decay is radiation.
constexpr std::uint64_t kFirstWithRadiationDecay = 2;
/// The version of the first files that have what is left of the series of modes.
constexpr std::uint64_t kFirstWithResidual = 3;

// ModelWriter and ModelReader have the same functions, so that one function for each structure
// (codeBody and so on) both writes and reads it: each call codes its argument, or sets it.

/// Encodes a model by appending to `bytes`.
class ModelWriter {
 public:
  explicit ModelWriter(std::vector<std::byte>& bytes) : bytes_(bytes) {}

  void number(std::unsigned_integral auto value) {
    for (std::size_t at = 0; at < sizeof value; ++at)
      bytes_.push_back(static_cast<std::byte>(value >> (kByteBits * at) & 0xFF));
  }
  void number(double value) { number(std::bit_cast<std::uint64_t>(value)); }
  void number(float value) { number(std::bit_cast<std::uint32_t>(value)); }
  /// Writes the number of the elements that follow; the reader checks it by the least bytes of
  /// each.
  template <class T>
  void count(const std::vector<T>& elements, std::size_t) {
    number(static_cast<std::uint64_t>(elements.size()));
  }
  void text(const std::string& value) {
    number(static_cast<std::uint64_t>(value.size()));
    for (const char letter : value)
      bytes_.push_back(static_cast<std::byte>(letter));
  }

  /// Writes tag, length and content; the length is filled in once the content is there.
  template <class Content>
  void section(std::string_view tag, const Content& content) {
    for (const char letter : tag)
      bytes_.push_back(static_cast<std::byte>(letter));
    const std::size_t lengthAt = bytes_.size();
    number(std::uint64_t{0});
    content(*this);
    std::vector<std::byte> length;
    ModelWriter(length).number(std::uint64_t{bytes_.size() - lengthAt - sizeof(std::uint64_t)});
    std::ranges::copy(length, bytes_.begin() + static_cast<std::ptrdiff_t>(lengthAt));
  }

 private:
  std::vector<std::byte>& bytes_;
};

/// Decodes a model from `bytes`; after the first fault, all that it reads is zero.
class ModelReader {
 public:
  /// `start` is where the bytes begin in the file, for messages.
  ModelReader(std::span<const std::byte> bytes, std::size_t start) : bytes_(bytes), start_(start) {}

  void number(std::unsigned_integral auto& value) {
    value = 0;
    if (!has(sizeof value)) return refuse("ends within a number");
    for (std::size_t at = 0; at < sizeof value; ++at)
      value |= static_cast<std::remove_cvref_t<decltype(value)>>(
          std::to_integer<std::uint64_t>(bytes_[at_ + at]) << (kByteBits * at));
    at_ += sizeof value;
  }
  void number(double& value) { value = std::bit_cast<double>(read<std::uint64_t>()); }
  void number(float& value) { value = std::bit_cast<float>(read<std::uint32_t>()); }
  /// Reads a count and resizes to it, but only if the bytes that are left can hold as many
  /// elements.
  template <class T>
  void count(std::vector<T>& elements, std::size_t bytesEach) {
    const auto size = read<std::uint64_t>();
    if (size > (bytes_.size() - at_) / bytesEach)
      return refuse("counts more elements than there are bytes");
    elements.resize(static_cast<std::size_t>(size));
  }
  void text(std::string& value) {
    const auto size = read<std::uint64_t>();
    if (!has(size)) return refuse("has a text that is longer than what is left");
    value.clear();
    for (const std::byte letter : bytes_.subspan(at_, static_cast<std::size_t>(size)))
      value.push_back(static_cast<char>(letter));
    at_ += value.size();
  }

  template <class Content>
  void section(std::string_view tag, const Content& content) {
    const std::string named = "section '" + std::string(tag) + "' ";
    if (!has(tag.size()) || !std::ranges::equal(bytes_.subspan(at_, tag.size()), tag, {}, {},
                                                [](char letter) { return std::byte(letter); }))
      return refuse("has no section '" + std::string(tag) + "' here");
    at_ += tag.size();
    const auto length = read<std::uint64_t>();
    if (!has(length)) return refuse(named + "is longer than the file");
    ModelReader inside(bytes_.subspan(at_, static_cast<std::size_t>(length)), start_ + at_);
    content(inside);
    inside.end();
    if (fault_.empty() && !inside.fault_.empty()) fault_ = named + inside.fault_;
    at_ += static_cast<std::size_t>(length);
  }

  void end() {
    if (at_ != bytes_.size())
      refuse("has " + std::to_string(bytes_.size() - at_) + " bytes too many");
  }
  /// Returns the first fault, and where it is; empty if there is none.
  const std::string& fault() const { return fault_; }

 private:
  bool has(std::uint64_t size) const { return fault_.empty() && size <= bytes_.size() - at_; }
  void refuse(const std::string& why) {
    if (fault_.empty()) fault_ = why + " (byte " + std::to_string(start_ + at_) + ")";
  }
  template <class T>
  T read() {
    T value{};
    number(value);
    return value;
  }

  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  std::size_t start_;
  std::string fault_;
};

/// Codes the numbers of a fixed-size matrix, row by row.
void codeMatrix(auto& archive, auto& matrix) {
  for (Eigen::Index row = 0; row < matrix.rows(); ++row)
    for (Eigen::Index column = 0; column < matrix.cols(); ++column)
      archive.number(matrix(row, column));
}

void codeBody(auto& archive, auto& model) {
  archive.text(model.name);
  archive.text(model.material.name);
  for (auto* value : {&model.material.density, &model.material.youngsModulus,
                      &model.material.poissonsRatio, &model.material.restitution,
                      &model.material.dampingAlpha, &model.material.dampingBeta, &model.mass})
    archive.number(*value);
  codeMatrix(archive, model.centreOfMass);
  codeMatrix(archive, model.inertia);
  archive.number(model.medium.density);
  archive.number(model.medium.speedOfSound);
  for (auto* count : {&model.leftOut.rigid, &model.leftOut.below, &model.leftOut.above,
                      &model.leftOut.overdamped})
    archive.number(*count);
}

void codeSurface(auto& archive, auto& surface) {
  archive.count(surface.vertices, 3 * sizeof(double));
  for (auto& vertex : surface.vertices)
    codeMatrix(archive, vertex);
  archive.count(surface.triangles, 3 * sizeof(std::uint32_t));
  for (auto& triangle : surface.triangles)
    for (auto& vertex : triangle)
      archive.number(vertex);
}

/// Codes a complex number as its real and its imaginary part.
void codeMultipole(ModelWriter& archive, const std::complex<double>& multipole) {
  archive.number(multipole.real());
  archive.number(multipole.imag());
}
void codeMultipole(ModelReader& archive, std::complex<double>& multipole) {
  double real = 0.0;
  double imaginary = 0.0;
  archive.number(real);
  archive.number(imaginary);
  multipole = {real, imaginary};
}

void codeModes(auto& archive, auto& modes, std::uint64_t version) {
  const bool hasRadiationDecay = version >= kFirstWithRadiationDecay;
  archive.count(modes, (hasRadiationDecay ? 4 : 3) * sizeof(double) + sizeof(std::uint64_t));
  for (auto& mode : modes) {
    archive.number(mode.frequency);
    archive.number(mode.decayRate);
    if (hasRadiationDecay) archive.number(mode.radiation.decayRate);
    archive.number(mode.radiation.volume);
    archive.count(mode.radiation.multipoles, 2 * sizeof(double));
    for (auto& multipole : mode.radiation.multipoles)
      codeMultipole(archive, multipole);
  }
}

void codeShapes(auto& archive, auto& shapes) {
  archive.count(shapes, sizeof(float));
  for (auto& value : shapes)
    archive.number(value);
}

void codeResidual(auto& archive, auto& model) {
  archive.number(model.residualFrequency);
  codeShapes(archive, model.residualVolumes);
}

void codeModel(auto& archive, auto& model, std::uint64_t version) {
  archive.section("body", [&](auto& inside) { codeBody(inside, model); });
  archive.section("surf", [&](auto& inside) { codeSurface(inside, model.surface); });
  archive.section("mode", [&](auto& inside) { codeModes(inside, model.modes, version); });
  archive.section("shap", [&](auto& inside) { codeShapes(inside, model.shapes); });
  if (version >= kFirstWithResidual)
    archive.section("resi", [&](auto& inside) { codeResidual(inside, model); });
}

std::uint64_t unsignedAt(std::span<const std::byte> bytes, std::size_t at, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t byte = 0; byte < size; ++byte)
    value |= std::to_integer<std::uint64_t>(bytes[at + byte]) << (kByteBits * byte);
  return value;
}

/// Returns the version of a file whose frame around the sections is valid.
Result<std::uint64_t> versionOf(std::span<const std::byte> bytes) {
  const auto begins = [&](std::string_view magic) {
    return bytes.size() >= magic.size() &&
           std::ranges::equal(bytes.first(magic.size()), magic, {}, {},
                              [](char letter) { return std::byte(letter); });
  };
  if (!begins(kModalModelMagic))
    return Error{"is no modal model; expected a file that begins with 'caromode'"};
  if (bytes.size() < kHeaderSize + kChecksumSize)
    return Error{"ends after " + std::to_string(bytes.size()) + " bytes; expected a whole model"};
  const std::uint64_t version =
      unsignedAt(bytes, kModalModelMagic.size(), sizeof kModalModelVersion);
  if (version < 1 || version > kModalModelVersion) {
    return Error{"is a modal model of version " + std::to_string(version) +
                 "; expected version 1 to " + std::to_string(kModalModelVersion)};
  }
  const std::size_t content = bytes.size() - kChecksumSize;
  if (unsignedAt(bytes, content, kChecksumSize) != modalModelChecksum(bytes.first(content)))
    return Error{"is damaged or cut off: its checksum does not fit; expected it as it was written"};
  return version;
}

}  // namespace

Result<std::vector<std::byte>> encodedModalModel(const ModalModel& model) {
  if (const Status valid = validate(model); !valid)
    return Error{"the model '" + model.name + "' cannot be written: " + valid.error().message};
  std::vector<std::byte> bytes;
  for (const char letter : kModalModelMagic)
    bytes.push_back(static_cast<std::byte>(letter));
  ModelWriter writer(bytes);
  writer.number(kModalModelVersion);
  codeModel(writer, model, kModalModelVersion);
  writer.number(modalModelChecksum(bytes));
  return bytes;
}

Result<ModalModel> decodedModalModel(std::span<const std::byte> bytes, std::string_view name) {
  const auto refuse = [name](const std::string& why) {
    return Error{std::string(name) + ": " + why};
  };
  const Result<std::uint64_t> version = versionOf(bytes);
  if (!version) return refuse(version.error().message);
  ModelReader reader(bytes.subspan(kHeaderSize, bytes.size() - kHeaderSize - kChecksumSize),
                     kHeaderSize);
  ModalModel model;
  codeModel(reader, model, *version);
  reader.end();
  if (!reader.fault().empty()) return refuse(reader.fault());
  if (const Status valid = validate(model); !valid) return refuse(valid.error().message);
  return model;
}

Status writeModalModel(const std::filesystem::path& path, const ModalModel& model) {
  const Result<std::vector<std::byte>> bytes = encodedModalModel(model);
  if (!bytes) return Error{path.string() + ": " + bytes.error().message};
  return writeBytes(path, *bytes);
}

Result<ModalModel> readModalModel(const std::filesystem::path& path) {
  const Result<std::vector<std::byte>> bytes = readBytes(path);
  if (!bytes) return Error{path.string() + ": " + bytes.error().message};
  return decodedModalModel(*bytes, path.string());
}

std::uint64_t modalModelChecksum(std::span<const std::byte> bytes) {
  constexpr std::uint64_t kOffsetBasis = 0xCBF29CE484222325U;
  constexpr std::uint64_t kPrime = 0x100000001B3U;
  std::uint64_t hash = kOffsetBasis;
  for (const std::byte byte : bytes)
    hash = (hash ^ std::to_integer<std::uint64_t>(byte)) * kPrime;
  return hash;
}

}  // namespace carom
