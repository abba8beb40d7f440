#pragma once

#include <filesystem>
#include <string>
#include <system_error>

namespace carom::audio {

/// An output file that appears whole or not at all: it is written beside its final place, gets its
/// name at the end, and goes with its owner if it never does. What had the name before stays until
/// then. Two writers of one name do not meet. [one thread]
class PartialFile {
 public:
  explicit PartialFile(const std::filesystem::path& finalPath);
  PartialFile(PartialFile&& other) noexcept;
  PartialFile& operator=(PartialFile&&) = delete;
  ~PartialFile();

  /// Where to write; empty once it has its name.
  const std::filesystem::path& path() const { return path_; }
  const std::filesystem::path& finalPath() const { return finalPath_; }

  std::error_code giveName();

 private:
  std::filesystem::path finalPath_;
  std::filesystem::path path_;
};

/// Why no file can be given this name, as the second half of a sentence; empty where one can, as
/// far as can be told without trying. A file there already is no obstacle, anything else is: a
/// device, for one, would be replaced.
std::string whyNoFileAt(const std::filesystem::path& path);

/// Whether both name one file, be it there or not.
bool isSameFile(const std::filesystem::path& path, const std::filesystem::path& other);

}  // namespace carom::audio
