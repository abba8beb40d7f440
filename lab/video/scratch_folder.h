#pragma once

#include <filesystem>

#include "lab/video/child_process.h"

namespace carom::lab {

/// A new folder for files that nobody needs afterwards, removed with the object, and when this
/// process ends in any other way: by a signal, SIGKILL too, or a crash. For the latter a shell
/// waits beside this process until it has gone. [one thread]
class ScratchFolder {
 public:
  /// `prepare` is that of ProgramStart.
  explicit ScratchFolder(void (*prepare)() = nullptr);
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  ~ScratchFolder();

  /// Empty if there can be no such folder.
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  Descriptor line_;  // the shell sees it closed when this process ends
  ChildProcess shell_;
};

}  // namespace carom::lab
