#include "carom/modal/model_cache.h"

#include <cstdlib>
#include <system_error>
#include <utility>
#include <variant>

#include "carom/audio/modal_model_file.h"
#include "modal/cache/model_key.h"

namespace carom {

using namespace modal;

namespace fs = std::filesystem;

ModelCache::ModelCache(fs::path folder) : folder_(std::move(folder)) {}

fs::path ModelCache::defaultFolder() {
  const auto absolute = [](const char* name) {
    const char* value = std::getenv(name);
    const fs::path path = value == nullptr ? "" : value;
    return path.is_absolute() ? path : fs::path();
  };
  if (const fs::path cache = absolute("XDG_CACHE_HOME"); !cache.empty()) return cache / "carom";
  if (const fs::path home = absolute("HOME"); !home.empty()) return home / ".cache" / "carom";
  return {};
}

fs::path ModelCache::fileOf(const ModelKey& key) const {
  return folder_ / (key.text() + std::string(kModalModelExtension));
}

std::optional<ModalModel> ModelCache::find(const ModelKey& key) const {
  if (folder_.empty()) return std::nullopt;
  Result<ModalModel> model = readModalModel(fileOf(key));
  if (!model) return std::nullopt;
  return *std::move(model);
}

Status ModelCache::store(const ModelKey& key, const ModalModel& model) {
  const auto complain = [this](std::string why) -> Status {
    if (std::exchange(complained_, true)) return std::monostate{};
    return Error{"the model is not cached: " + std::move(why)};
  };
  if (folder_.empty()) return complain("neither XDG_CACHE_HOME nor HOME names a folder");
  std::error_code failed;
  fs::create_directories(folder_, failed);
  if (failed) return complain(folder_.string() + ": " + failed.message());
  if (const Status written = writeModalModel(fileOf(key), model); !written)
    return complain(written.error().message);
  return std::monostate{};
}

}  // namespace carom
