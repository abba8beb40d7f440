#pragma once

#include <filesystem>
#include <functional>
#include <system_error>
#include <vector>

#include "carom/audio/result.h"

namespace carom::audio {

/// The fate of a partial file whose program has ended.
enum class Leftover {
  removed,  ///< it is worth nothing: what made it can make it again
  kept      ///< it can be used as it is, and nobody can make it again: a recording
};

/// The moment by which a file is on the disk: before it gets its name, which takes some ms, or when
/// the system likes. Where the machine fails before, a file has its name then and may not be whole.
enum class Sync { disk, none };

/// An output file that appears whole or not at all: it is written beside its final place, brought
/// to the disk and renamed at the end; if it never is, it is deleted with this object. A file that
/// had the name before stays until then. Two writers of one name do not meet. A process that ends
/// without destroying the object leaves the partial file behind, which the next object of the same
/// name removes, or `keepLeftovers` keeps: nobody holds a lock on it, as the system drops a lock
/// when its process ends, in whichever way and on whichever host. Where the system has no such
/// locks it stays. [one thread]
///
///     out.wav.4f00ba12.partial       Leftover::removed
///     out.wav.4f00ba12.partial.wav   Leftover::kept: the ending says what it is
///     out.incomplete.wav             such a file, found by `keepLeftovers`
class PartialFile {
 public:
  /// Removes what others have left under the name, Leftover::removed, and creates the file, if that
  /// can be, with a lock on it.
  explicit PartialFile(const std::filesystem::path& finalPath,
                       Leftover leftover = Leftover::removed);
  PartialFile(PartialFile&& other) noexcept;
  PartialFile& operator=(PartialFile&&) = delete;
  ~PartialFile();

  /// The path to write to; empty once the file has a name.
  const std::filesystem::path& path() const { return path_; }
  const std::filesystem::path& finalPath() const { return finalPath_; }

  /// Gives the file its name, in place of one that had it. By default what was written is brought
  /// to the disk first.
  std::error_code giveName(Sync sync = Sync::disk);

  /// Gives a file that is not whole a name, and returns it: the final one if that is free, or else
  /// one beside it, so that nothing is replaced. Without success the file stays as it is for good.
  Result<std::filesystem::path> keepIncomplete();

  /// Gives names beside the final one to the files of Leftover::kept that dead programs have left,
  /// and returns them. Removes those that are not `isOfUse`.
  static std::vector<std::filesystem::path> keepLeftovers(
      const std::filesystem::path& finalPath,
      const std::function<bool(const std::filesystem::path&)>& isOfUse);

  /// Removes all partial files of this process, and lets no other get its name: for a program that
  /// is about to end on a signal. Those of Leftover::kept stay. [any thread]
  static void removeAll();

 private:
  std::filesystem::path finalPath_;
  std::filesystem::path path_;
  [[maybe_unused]] int lock_ = -1;  // descriptor that holds the lock, or -1
};

/// Refuses a name that no file can be given, as far as can be told without trying; the message is
/// the second half of a sentence. A regular file of that name is no obstacle, anything else
/// is: a device, for one, would be replaced.
Status checkWritable(const std::filesystem::path& path);

/// True if both paths name one file, whether it exists or not.
bool isSameFile(const std::filesystem::path& path, const std::filesystem::path& other);

}  // namespace carom::audio
