#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "carom/audio/result.h"

namespace carom::command {

/// A file that a command writes, and the option that has named it. An empty path is none.
struct WrittenFile {
  std::string option;
  std::filesystem::path file;
};

/// Refuses what is written in the place of what is read, whatever the names of both.
Status checkKept(const std::vector<WrittenFile>& written,
                 const std::vector<std::filesystem::path>& read);

}  // namespace carom::command
