#pragma once

#include <filesystem>
#include <string>
#include <system_error>

#include "carom/audio/result.h"

namespace carom::audio {

/// An output file that appears whole or not at all: it is written beside its final place and
/// renamed at the end; if it never is, it is deleted with this object. A file that had the name
/// before stays until then. Two writers of one name do not meet. A process that ends without
/// destroying the object leaves the partial file behind: see `removeLeftovers`. [one thread]
class PartialFile {
 public:
  /// Creates the file, if that can be, and holds a lock on it.
  explicit PartialFile(const std::filesystem::path& finalPath);
  PartialFile(PartialFile&& other) noexcept;
  PartialFile& operator=(PartialFile&&) = delete;
  ~PartialFile();

  /// The path to write to; empty once the file has its final name.
  const std::filesystem::path& path() const { return path_; }
  const std::filesystem::path& finalPath() const { return finalPath_; }

  std::error_code giveName();

  /// Removes the partial files of one name whose writers are gone: nobody holds a lock on them.
  /// Does nothing where the system has no such locks.
  static void removeLeftovers(const std::filesystem::path& finalPath);

 private:
  std::filesystem::path finalPath_;
  std::filesystem::path path_;
  int lock_ = -1;  // descriptor that holds the lock, or -1
};

/// Refuses a name that no file can be given, as far as can be told without trying; the message is
/// the second half of a sentence. A regular file of that name is no obstacle, anything else
/// is: a device, for one, would be replaced.
Status checkWritable(const std::filesystem::path& path);

/// True if both paths name one file, whether it exists or not.
bool isSameFile(const std::filesystem::path& path, const std::filesystem::path& other);

}  // namespace carom::audio
