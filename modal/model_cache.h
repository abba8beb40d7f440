#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "audio/material.h"
#include "audio/modal_model.h"
#include "audio/result.h"
#include "audio/surface_mesh.h"
#include "modal/sha256.h"

namespace carom {

/// The name of a model by all that it is computed from: SHA-256 of what is added, in the order in
/// which it is. Each goes with its kind, texts and meshes with their lengths, so that ("ab", "c")
/// is not ("a", "bc"). Add the version of the analysis, too, and raise it with every change of what
/// comes out. [any thread, one at a time]
class ModelKey {
 public:
  ModelKey& add(std::string_view text);
  ModelKey& add(double number);  ///< by its bits: -0 is not 0
  ModelKey& add(std::uint64_t number);
  ModelKey& add(const Material& material);  ///< all fields, the name among them
  ModelKey& add(const SurfaceMesh& mesh);

  /// 64 hexadecimal digits.
  std::string text() const;

 private:
  void hashKind(char kind);
  void hashNumber(std::uint64_t number);

  Sha256 hash_;
};

/// Models that were computed before, one file each (audio/modal_model_file.h) in one folder, which
/// is made when the first is stored. Nothing is ever deleted; the folder may be, at any time.
///
/// Several caches, threads and processes may share a folder: a file appears whole or not at all,
/// and two that store under one key store the same. A cache itself: one thread at a time.
class ModelCache {
 public:
  explicit ModelCache(std::filesystem::path folder = defaultFolder());

  /// $XDG_CACHE_HOME/carom, or ~/.cache/carom (XDG Base Directory Specification 0.8, which has a
  /// path that is not absolute ignored); empty where neither is known, and nothing is cached then.
  static std::filesystem::path defaultFolder();

  const std::filesystem::path& folder() const { return folder_; }

  /// Nothing if it was never stored, or if its file is damaged or of another version: store it anew
  /// then. Blocks on the disk.
  std::optional<ModalModel> find(const ModelKey& key) const;

  /// An error says why it could not be stored, which is no reason to stop: only the first time, for
  /// later ones would say the same. Blocks on the disk.
  Status store(const ModelKey& key, const ModalModel& model);

 private:
  std::filesystem::path fileOf(const ModelKey& key) const;

  std::filesystem::path folder_;
  bool complained_ = false;
};

}  // namespace carom
