#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "carom/audio/material.h"
#include "carom/audio/surface_mesh.h"
#include "modal/cache/sha256.h"

namespace carom::modal {

/// The key of a model, by all that it is computed from: SHA-256 of the items that are added, in
/// their order. Each goes with its kind, texts and meshes with their lengths, so that ("ab", "c")
/// is not ("a", "bc"). Add the version of the analysis, too, and raise it with every change of the
/// results. [any thread, one at a time]
class ModelKey {
 public:
  ModelKey& add(std::string_view text);
  ModelKey& add(double number);  ///< by its bits: -0 is not 0
  ModelKey& add(std::uint64_t number);
  ModelKey& add(const Material& material);  ///< all fields, the name among them
  ModelKey& add(const SurfaceMesh& mesh);

  /// Returns the key as 64 hexadecimal digits.
  std::string text() const;

 private:
  void hashKind(char kind);
  void hashNumber(std::uint64_t number);

  Sha256 hash_;
};

}  // namespace carom::modal
