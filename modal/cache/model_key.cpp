#include "modal/cache/model_key.h"

#include <array>
#include <bit>
#include <span>

namespace carom::modal {

void ModelKey::hashKind(char kind) {
  const std::byte byte{static_cast<unsigned char>(kind)};
  hash_.add({&byte, 1});
}

void ModelKey::hashNumber(std::uint64_t number) {
  std::array<std::byte, sizeof number> bytes{};
  for (std::size_t at = 0; at < bytes.size(); ++at)
    bytes[at] = static_cast<std::byte>(number >> (8 * at) & 0xFF);
  hash_.add(bytes);
}

ModelKey& ModelKey::add(std::uint64_t number) {
  hashKind('u');
  hashNumber(number);
  return *this;
}

ModelKey& ModelKey::add(double number) {
  hashKind('d');
  hashNumber(std::bit_cast<std::uint64_t>(number));
  return *this;
}

ModelKey& ModelKey::add(std::string_view text) {
  hashKind('t');
  hashNumber(text.size());
  hash_.add(std::as_bytes(std::span(text)));
  return *this;
}

ModelKey& ModelKey::add(const Material& material) {
  add(std::string_view(material.name)).add(material.density).add(material.youngsModulus);
  add(material.poissonsRatio).add(material.restitution);
  add(material.dampingAlpha).add(material.dampingBeta);
  add(material.lossFactor).add(material.lossExponent);
  const ThermalProperties& thermal = material.thermal;
  return add(thermal.expansion).add(thermal.conductivity).add(thermal.heatCapacity);
}

ModelKey& ModelKey::add(const SurfaceMesh& mesh) {
  hashKind('s');
  hashNumber(mesh.vertices.size());
  hashNumber(mesh.triangles.size());
  for (const Vec3& vertex : mesh.vertices)
    for (const double coordinate : vertex)
      hashNumber(std::bit_cast<std::uint64_t>(coordinate));
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t vertex : triangle)
      hashNumber(vertex);
  return *this;
}

std::string ModelKey::text() const {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const std::byte byte : Sha256(hash_).finish()) {
    text += kDigits[std::to_integer<std::size_t>(byte >> 4)];
    text += kDigits[std::to_integer<std::size_t>(byte & std::byte{0xF})];
  }
  return text;
}

}  // namespace carom::modal
