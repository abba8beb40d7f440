#include "command/output/output_target.h"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <utility>

#include "command/terminal/terminal.h"
#include <unistd.h>

namespace carom::command {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kPiece = 65536;

/// Writes all of it; false if that cannot be.
bool writeAll(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = write(STDOUT_FILENO, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

}  // namespace

Result<OutputTarget> OutputTarget::create(const std::string& name, const std::string& option) {
  OutputTarget target;
  target.path_ = target.shown_ = name;
  if (name != kStandardOutput) return target;
  if (isatty(STDOUT_FILENO) == 1)
    return Error{option +
                 ": standard output is a terminal; expected a pipe or a file behind it, as in: "
                 "carom ... -o - > FILE"};
  std::error_code failed;
  const fs::path folder = fs::temp_directory_path(failed);
  if (failed)
    return Error{
        option +
        ": there is no folder for temporary files; expected one that TMPDIR names, or /tmp"};
  target.file_.emplace(folder / ("carom-output-" + std::to_string(getpid())));
  target.path_ = target.file_->path().string();
  target.shown_ = "standard output";
  talk().isOutputTaken = true;
  return target;
}

Status OutputTarget::finish() const {
  if (!file_) return std::monostate{};
  // A reader that has gone is an error like any other, and the temporary file is to be removed.
  std::signal(SIGPIPE, SIG_IGN);
  std::ifstream file(path_, std::ios::binary);
  std::array<char, kPiece> piece{};
  while (file) {
    file.read(piece.data(), static_cast<std::streamsize>(piece.size()));
    if (!writeAll({piece.data(), static_cast<std::size_t>(file.gcount())}))
      return Error{std::string("standard output cannot be written: ") + std::strerror(errno)};
  }
  if (!file.eof()) return Error{"the temporary file '" + path_ + "' cannot be read again"};
  return std::monostate{};
}

Status refuseStandardOutput(const std::string& name, const std::string& option,
                            const std::string& why) {
  if (name != kStandardOutput) return std::monostate{};
  return Error{option + ": standard output cannot be meant here: " + why};
}

}  // namespace carom::command
