#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "carom/audio/result.h"

namespace carom::modal {

// glTF 2.0 as far as an extension with accessors needs it (Khronos, glTF 2.0 specification, 3.6 on
// buffers and accessors, 4 on GLB). Internal to modal/: nothing here is in an installed header.

using Json = nlohmann::ordered_json;

/// A value of a document, and the JSON pointer to it. The first fault that any view of a document
/// meets is kept in the document; after it, all views give empty values.
class JsonView {
 public:
  JsonView(const Json& value, std::string pointer, std::string& fault)
      : value_(&value), pointer_(std::move(pointer)), fault_(&fault) {}

  bool has(const std::string& key) const;
  /// Returns a member; null if there is none.
  JsonView member(const std::string& key) const;
  /// Returns the elements of an array, which may be absent, but not be anything else.
  std::vector<JsonView> elements() const;
  /// Returns the element of this array whose index `reference` holds; `kind` is what messages call
  /// such elements.
  JsonView element(const JsonView& reference, const std::string& kind) const;
  bool isTrue(const std::string& key) const;

  double number() const;
  std::size_t index() const;  ///< an integer from 0
  std::string text() const;

  /// Values of members; `absent` is returned if the key is absent.
  double number(const std::string& key, double absent) const;
  std::optional<double> numberIf(const std::string& key) const;
  std::size_t index(const std::string& key, std::size_t absent) const;
  std::optional<std::size_t> indexIf(const std::string& key) const;
  std::string text(const std::string& key) const;  ///< empty if absent
  /// Reads as many numbers as `values` holds into it; it stays as it is if the key is absent.
  void numbers(const std::string& key, std::span<double> values) const;

  void refuse(const std::string& why) const;

 private:
  const Json* value_;
  std::string pointer_;
  std::string* fault_;
};

/// A glTF file that is read.
class GltfDocument {
 public:
  /// `folder` holds the external buffers; it is empty if none may be read.
  static Result<GltfDocument> parse(std::span<const std::byte> bytes,
                                    const std::filesystem::path& folder);

  JsonView root() { return JsonView(json_, "", fault_); }
  /// The first fault, with its JSON pointer in front; empty if there is none so far.
  const std::string& fault() const { return fault_; }

  /// Returns the numbers of an accessor; `reference` is the member with its index, for messages.
  std::vector<float> scalars(const JsonView& reference);
  std::vector<Eigen::Vector3f> vectors(const JsonView& reference);
  std::vector<std::uint32_t> indices(const JsonView& reference);

 private:
  struct Elements;

  Elements elementsOf(const JsonView& reference, std::string_view type,
                      std::span<const std::size_t> componentTypes);
  void checkKind(const JsonView& accessor, std::string_view type,
                 std::span<const std::size_t> componentTypes);
  std::span<const std::byte> bytesOf(const JsonView& bufferView);
  std::span<const std::byte> bufferOf(const JsonView& reference);
  std::vector<std::byte> loadBuffer(std::size_t which, const JsonView& buffer);

  Json json_;
  std::optional<std::vector<std::byte>> binaryChunk_;
  std::filesystem::path folder_;
  std::map<std::size_t, std::vector<std::byte>> buffers_;  // buffers that were asked for
  std::size_t bytesRead_ = 0;
  std::string fault_;
};

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
