#include "scenes/limits/incomplete_names.h"

#include <string>
#include <system_error>

namespace carom::scenes {
namespace {

namespace fs = std::filesystem;

/// Returns "out.incomplete.wav" for "out.wav", or the first name with a number that is free.
fs::path freeName(const fs::path& file) {
  std::error_code ignored;
  for (int number = 1;; ++number) {
    fs::path name = file.stem();
    name += ".incomplete";
    if (number > 1) name += "-" + std::to_string(number);
    name += file.extension();
    fs::path path = file.parent_path() / name;
    if (!fs::exists(fs::symlink_status(path, ignored))) return path;
  }
}

}  // namespace

const fs::path& IncompleteNames::of(const fs::path& file) {
  const auto known = names_.find(file);
  if (known != names_.end()) return known->second;
  return names_.emplace(file, keepPartial_ ? freeName(file) : file).first->second;
}

Status IncompleteNames::complete() {
  if (!keepPartial_) return std::monostate{};
  for (const auto& [file, name] : names_) {
    std::error_code failed;
    fs::rename(name, file, failed);
    if (failed)
      return Error{file.string() + ": cannot be written: " + failed.message() +
                   "; expected a name that is free, or a file that may be replaced; it stays in " +
                   name.string()};
  }
  return std::monostate{};
}

}  // namespace carom::scenes
