#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include <carom/audio/modal_model.h>
#include <carom/audio/result.h>
#include <carom/audio/rigid_radiator.h>

namespace carom {

namespace modal {
class ModelKey;
}

/// A store of models, and of the recoils of shapes, that were computed before, one file each
/// (audio/modal_model_file.h, modal/cache/recoil_file.h) in one folder, which is made when the
/// first is stored. Nothing is ever deleted; the folder may be, at any time.
///
/// Several caches, threads and processes may share a folder: a file appears whole or not at all,
/// and two that store under one key store the same. A ModelCache itself is for one thread at a
/// time.
class ModelCache {
 public:
  explicit ModelCache(std::filesystem::path folder = defaultFolder());

  /// Returns $XDG_CACHE_HOME/carom, or ~/.cache/carom (XDG Base Directory Specification 0.8, by
  /// which a path that is not absolute is ignored); empty if neither is known, and nothing is
  /// cached then.
  static std::filesystem::path defaultFolder();

  const std::filesystem::path& folder() const { return folder_; }

  /// Returns nothing if the model was never stored, or if its file is damaged or of another
  /// version: store it anew then. Blocks on the disk.
  std::optional<ModalModel> find(const modal::ModelKey& key) const;

  /// Stores a model. An error says why that failed, which is no reason to stop; only the first
  /// failure is reported, for later ones would say the same. Blocks on the disk.
  Status store(const modal::ModelKey& key, const ModalModel& model);

  /// The same for the recoil of a shape.
  std::optional<RigidRecoil> findRecoil(const modal::ModelKey& key) const;
  Status storeRecoil(const modal::ModelKey& key, const RigidRecoil& recoil);

 private:
  std::filesystem::path fileOf(const modal::ModelKey& key, std::string_view extension) const;
  Status complain(std::string why);
  Status makeFolder();

  std::filesystem::path folder_;
  bool complained_ = false;
};

}  // namespace carom
