#include "modal/cache/model_claim.h"

#include <cerrno>

#include "audio/io/byte_file.h"

// WebAssembly has the header, but neither files nor locks.
#if __has_include(<sys/file.h>) && !defined(__wasm__)
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>
#define CAROM_MODEL_LOCKS 1
#else
#define CAROM_MODEL_LOCKS 0
#endif

namespace carom::modal {

#if CAROM_MODEL_LOCKS
namespace {

constexpr unsigned kPatience = 20'000;  // us, between two looks at a lock

}  // namespace

ModelClaim::ModelClaim(const std::filesystem::path& folder, const ModelKey& key,
                       const Progress& progress) {
  if (folder.empty()) return;
  (void)audio::makeFolder(folder);
  path_ = folder / (key.text() + ".lock");
  lock_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  while (lock_ >= 0 && ::flock(lock_, LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK && errno != EINTR) return;
    if (progress && !progress("another process computes it", 0.0)) {
      cancelled_ = true;
      return;
    }
    ::usleep(kPatience);
  }
}

ModelClaim::~ModelClaim() {
  if (lock_ < 0) return;
  // Whoever waits for the file without a name gets the lock, and finds the model.
  if (!cancelled_) ::unlink(path_.c_str());
  ::close(lock_);
}
#else
ModelClaim::ModelClaim(const std::filesystem::path&, const ModelKey&, const Progress&) {}
ModelClaim::~ModelClaim() = default;
#endif

}  // namespace carom::modal
