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
/// meets is kept in the document; after it, all they give is empty.
class JsonView {
 public:
  JsonView(const Json& value, std::string pointer, std::string& fault)
      : value_(&value), pointer_(std::move(pointer)), fault_(&fault) {}

  bool has(const std::string& key) const;
  /// A member; null where there is none.
  JsonView member(const std::string& key) const;
  /// The elements of an array, which may be absent, but not be anything else.
  std::vector<JsonView> elements() const;
  /// The element that `reference` has the index of: one of this array of things of that kind.
  JsonView element(const JsonView& reference, const std::string& kind) const;
  bool isTrue(const std::string& key) const;

  double number() const;
  std::size_t index() const;  ///< an integer from 0
  std::string text() const;

  /// Of members: what is given if the key is absent.
  double number(const std::string& key, double absent) const;
  std::optional<double> numberIf(const std::string& key) const;
  std::size_t index(const std::string& key, std::size_t absent) const;
  std::optional<std::size_t> indexIf(const std::string& key) const;
  std::string text(const std::string& key) const;  ///< empty if absent
  /// So many numbers, into `values`, which stay as they are if the key is absent.
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
  /// `folder`: of external buffers; empty if none may be read.
  static Result<GltfDocument> parse(std::span<const std::byte> bytes,
                                    const std::filesystem::path& folder);

  JsonView root() { return JsonView(json_, "", fault_); }
  /// What is wrong, the JSON pointer first; empty so far.
  const std::string& fault() const { return fault_; }

  /// The numbers that an accessor has; `reference` is the member with its index, for messages.
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
  std::map<std::size_t, std::vector<std::byte>> buffers_;  // those that were asked for
  std::size_t bytesRead_ = 0;
  std::string fault_;
};

/// A glTF file that is made: one buffer, and an accessor for each array.
class GltfBuilder {
 public:
  /// The index of the new accessor.
  std::size_t scalars(std::span<const float> values);
  std::size_t vectors(std::span<const Eigen::Vector3f> values);
  std::size_t indices(std::span<const std::uint32_t> values);

  /// The file: `json` with asset, accessors, buffer views and the buffer added.
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
