#include "carom/audio/modal_model_file.h"

#include <algorithm>
#include <bit>
#include <complex>
#include <concepts>
#include <string>
#include <type_traits>

#include "audio/io/byte_file.h"
#include "audio/io/field_code.h"

namespace carom {

using namespace audio;

namespace {

constexpr std::size_t kHeaderSize = kModalModelMagic.size() + sizeof(std::uint32_t);
constexpr std::size_t kChecksumSize = sizeof(std::uint64_t);
/// The version of the first files that say which part of a mode's decay is radiation.
constexpr std::uint64_t kFirstWithRadiationDecay = 2;
/// The version of the first files that have what is left of the series of modes.
constexpr std::uint64_t kFirstWithResidual = 3;
/// The version of the first files that have materials with a loss factor, and errors of
/// frequencies.
constexpr std::uint64_t kFirstWithErrors = 4;
/// The version of the first files that have materials with thermal properties, and say which part
/// of a mode's decay is lost by heat.
constexpr std::uint64_t kFirstWithHeat = 5;

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
      codeComplex(archive, multipole);
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

void codeLoss(auto& archive, auto& material) {
  archive.number(material.lossFactor);
  archive.number(material.lossExponent);
}

void codeErrors(auto& archive, auto& modes) {
  for (auto& mode : modes)
    archive.number(mode.frequencyError);
}

void codeHeat(auto& archive, auto& model) {
  auto& thermal = model.material.thermal;
  for (auto* value : {&thermal.expansion, &thermal.conductivity, &thermal.heatCapacity})
    archive.number(*value);
  for (auto& mode : model.modes)
    archive.number(mode.heatDecayRate);
}

void codeModel(auto& archive, auto& model, std::uint64_t version) {
  archive.section("body", [&](auto& inside) { codeBody(inside, model); });
  archive.section("surf", [&](auto& inside) { codeSurface(inside, model.surface); });
  archive.section("mode", [&](auto& inside) { codeModes(inside, model.modes, version); });
  archive.section("shap", [&](auto& inside) { codeShapes(inside, model.shapes); });
  if (version >= kFirstWithResidual)
    archive.section("resi", [&](auto& inside) { codeResidual(inside, model); });
  if (version < kFirstWithErrors) return;
  archive.section("loss", [&](auto& inside) { codeLoss(inside, model.material); });
  archive.section("errs", [&](auto& inside) { codeErrors(inside, model.modes); });
  if (version < kFirstWithHeat) return;
  archive.section("heat", [&](auto& inside) { codeHeat(inside, model); });
}

std::uint64_t unsignedAt(std::span<const std::byte> bytes, std::size_t at, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t byte = 0; byte < size; ++byte)
    value |= std::to_integer<std::uint64_t>(bytes[at + byte]) << (8 * byte);
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
  FieldWriter writer(bytes);
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
  FieldReader reader(bytes.subspan(kHeaderSize, bytes.size() - kHeaderSize - kChecksumSize),
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
