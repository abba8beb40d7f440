#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>

#include "carom/audio/result.h"
#include "modal/json/json_reader.h"

namespace carom::modal {

// glTF 2.0 as far as an extension with accessors needs it (Khronos, glTF 2.0 specification, 3.6 on
// buffers and accessors, 4 on GLB). Internal to modal/: nothing here is in an installed header.

/// A glTF file that is read.
class GltfDocument {
 public:
  /// Parses a file; `name` begins the messages, and `folder` holds the external buffers: it is
  /// empty if none may be read.
  static Result<GltfDocument> parse(std::span<const std::byte> bytes, std::string_view name,
                                    const std::filesystem::path& folder);

  JsonNode root() { return JsonNode(*json_, "", error_); }
  /// The first error in the document or in an accessor that was read, if there is one.
  const FirstError& error() const { return error_; }

  /// Returns the numbers of an accessor; `reference` is the member with its index, for messages.
  std::vector<float> scalars(const JsonNode& reference);
  std::vector<Eigen::Vector2f> pairs(const JsonNode& reference);
  std::vector<Eigen::Vector3f> vectors(const JsonNode& reference);
  std::vector<std::uint32_t> indices(const JsonNode& reference);
  /// Returns indices as `indices` does, which may also be bytes.
  std::vector<std::uint32_t> meshIndices(const JsonNode& reference);

 private:
  struct Elements;

  Elements elementsOf(const JsonNode& reference, std::string_view type,
                      std::span<const std::size_t> componentTypes);
  std::vector<std::uint32_t> indicesOf(const JsonNode& reference,
                                       std::span<const std::size_t> componentTypes);
  void checkKind(const JsonNode& accessor, std::string_view type,
                 std::span<const std::size_t> componentTypes);
  std::span<const std::byte> bytesOf(const JsonNode& bufferView);
  std::span<const std::byte> bufferOf(const JsonNode& reference);
  std::vector<std::byte> loadBuffer(std::size_t which, const JsonNode& buffer);

  explicit GltfDocument(std::string_view name) : error_(name) {}

  std::shared_ptr<const nlohmann::json> json_;
  std::optional<std::vector<std::byte>> binaryChunk_;
  std::filesystem::path folder_;
  std::map<std::size_t, std::vector<std::byte>> buffers_;  // buffers that were asked for
  std::size_t bytesRead_ = 0;
  FirstError error_;
};

}  // namespace carom::modal
