#include "carom/modal/model_cache.h"

#include <cstdlib>
#include <system_error>
#include <utility>
#include <variant>

#include "audio/io/byte_file.h"
#include "carom/audio/modal_model_file.h"
#include "modal/cache/model_key.h"
#include "modal/cache/recoil_file.h"

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

fs::path ModelCache::fileOf(const ModelKey& key, std::string_view extension) const {
  return folder_ / (key.text() + std::string(extension));
}

std::optional<ModalModel> ModelCache::find(const ModelKey& key) const {
  if (folder_.empty()) return std::nullopt;
  Result<ModalModel> model = readModalModel(fileOf(key, kModalModelExtension));
  if (!model) return std::nullopt;
  return *std::move(model);
}

std::optional<RigidRecoil> ModelCache::findRecoil(const ModelKey& key) const {
  if (folder_.empty()) return std::nullopt;
  return readRecoil(fileOf(key, kRecoilExtension));
}

Status ModelCache::complain(std::string why) {
  if (std::exchange(complained_, true)) return std::monostate{};
  return Error{"the model is not cached: " + std::move(why)};
}

Status ModelCache::makeFolder() {
  if (folder_.empty()) return Error{"neither XDG_CACHE_HOME nor HOME names a folder"};
  if (const std::error_code failed = audio::makeFolder(folder_); failed)
    return Error{folder_.string() + ": " + failed.message()};
  return std::monostate{};
}

Status ModelCache::store(const ModelKey& key, const ModalModel& model) {
  Status stored = makeFolder();
  if (stored) stored = writeModalModel(fileOf(key, kModalModelExtension), model);
  return stored ? stored : complain(stored.error().message);
}

Status ModelCache::storeRecoil(const ModelKey& key, const RigidRecoil& recoil) {
  Status stored = makeFolder();
  if (stored) stored = writeRecoil(fileOf(key, kRecoilExtension), recoil);
  return stored ? stored : complain(stored.error().message);
}

}  // namespace carom
