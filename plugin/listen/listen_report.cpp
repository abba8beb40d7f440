#include "plugin/listen/listen_report.h"

#include <algorithm>
#include <cstdlib>

#include <fcntl.h>
#include <unistd.h>

#include "plugin/listen/listen_protocol.h"

namespace carom::listen {
namespace {

constexpr int kOwnersOnly = 0600;

/// Opens a file in the folder of the command; -1 without one.
int openInFolder(const std::string& name, int flags) {
  const char* const folder = std::getenv(kFolderVariable);
  if (folder == nullptr) return -1;
  return open((std::string(folder) + "/" + name).c_str(), flags | O_CLOEXEC, kOwnersOnly);
}

}  // namespace

void addToReport(const std::string& line) {
  const int file = openInFolder(kReportFile, O_WRONLY | O_CREAT | O_APPEND);
  if (file < 0) return;
  std::string whole = line;
  std::ranges::replace(whole, '\n', ' ');
  whole += '\n';
  [[maybe_unused]] const ssize_t written = write(file, whole.data(), whole.size());
  close(file);
}

void tellUser(const std::string& sentence) {
  addToReport("message " + sentence);
}

bool claim(const std::string& name) {
  const int file = openInFolder(name, O_WRONLY | O_CREAT | O_EXCL);
  if (file < 0) return false;
  close(file);
  return true;
}

}  // namespace carom::listen
