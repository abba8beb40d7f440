#pragma once

#include <filesystem>

#include "carom/modal/analysis_settings.h"
#include "modal/cache/model_key.h"

namespace carom::modal {

/// Keeps other processes and threads of this machine from computing what has the same key
/// meanwhile: they wait until this object goes, and find it in the cache then. Where the folder
/// cannot be written, or the system has no locks, it keeps nobody from anything. A process that
/// dies drops its claim. [one thread]
class ModelClaim {
 public:
  /// Waits while another has the claim; `progress` is asked now and then, and ends that by false.
  /// `folder` is that of the cache; empty: there is none.
  ModelClaim(const std::filesystem::path& folder, const ModelKey& key, const Progress& progress);
  ModelClaim(const ModelClaim&) = delete;
  ModelClaim& operator=(const ModelClaim&) = delete;
  ~ModelClaim();

  bool isCancelled() const { return cancelled_; }

 private:
  std::filesystem::path path_;
  int lock_ = -1;  // descriptor, or -1
  bool cancelled_ = false;
};

}  // namespace carom::modal
