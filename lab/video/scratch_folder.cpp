#include "lab/video/scratch_folder.h"

#include <cstdlib>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

#include <unistd.h>

namespace carom::lab {

namespace {

/// Waits for the end of its input, and then for whoever still writes into the folder.
constexpr const char* kSweep =
    "read -r word; n=0; "
    "while [ -e \"$1\" ] && [ $n -lt 100 ]; do "
    "rm -rf -- \"$1\" 2>/dev/null; n=$((n + 1)); sleep 0.05; done";
constexpr int kSweeps = 100;  // tries, as a browser may still write on its way out
constexpr std::chrono::milliseconds kBetweenSweeps(20);
constexpr std::chrono::milliseconds kShellEnds(10'000);

}  // namespace

ScratchFolder::ScratchFolder(void (*prepare)()) {
  std::error_code ignored;
  std::string name =
      (std::filesystem::temp_directory_path(ignored) / "carom-video-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) return;
  path_ = name;
  auto [ours, theirs] = connectedPair();
  line_ = std::move(ours);
  shell_ = ChildProcess({.words = {"/bin/sh", "-c", kSweep, "sh", name},
                         .channels = {{STDIN_FILENO, theirs.number()}},
                         .diesWithUs = false,
                         .prepare = prepare});
}

ScratchFolder::~ScratchFolder() {
  std::error_code failed;
  for (int sweep = 0; sweep < kSweeps && !path_.empty(); ++sweep) {
    std::filesystem::remove_all(path_, failed);
    if (!failed) break;
    std::this_thread::sleep_for(kBetweenSweeps);
  }
  line_.close();
  shell_.wait(kShellEnds);
}

}  // namespace carom::lab
