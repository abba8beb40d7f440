#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

namespace carom::modal {

using Json = nlohmann::ordered_json;

/// A glTF file that is made: one buffer, and an accessor for each array.
class GltfBuilder {
 public:
  /// Adds an array, and returns the index of its new accessor.
  std::size_t scalars(std::span<const float> values);
  std::size_t vectors(std::span<const Eigen::Vector3f> values);
  std::size_t indices(std::span<const std::uint32_t> values);

  /// Returns the file: `json` with asset, accessors, buffer views and the buffer added.
  std::vector<std::byte> gltf(Json json) const;
  std::vector<std::byte> glb(Json json) const;

 private:
  std::size_t accessor(std::span<const std::byte> bytes, std::size_t count, const char* type,
                       std::size_t componentType);
  std::string text(Json json, bool embedded) const;

  std::vector<std::byte> buffer_;
  Json accessors_ = Json::array();
  Json bufferViews_ = Json::array();
};

}  // namespace carom::modal
