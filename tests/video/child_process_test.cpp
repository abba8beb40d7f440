#include "lab/video/child_process.h"

#include <array>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>

#include "lab/video/scratch_folder.h"
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/support/temporary_folder.h"

namespace carom::lab {
namespace {

using test::contents;
using test::TemporaryFolder;

constexpr std::chrono::seconds kPatient(60);

/// A shell that runs a script, with one connection to this process as its stdin.
ChildProcess shell(const std::string& script, const Descriptor& input,
                   const std::filesystem::path& messages = {}) {
  return ChildProcess({.words = {"/bin/sh", "-c", script},
                       .channels = {{STDIN_FILENO, input.number()}},
                       .messages = messages});
}

TEST(ChildProcesses, GetWhatIsSentAndTellTheirExitCode) {
  const TemporaryFolder folder;
  auto [ours, theirs] = connectedPair();
  ChildProcess child = shell("cat >&2; exit 7", theirs, folder / "said");
  theirs.close();
  const std::string text(1'000'000, 'x');
  EXPECT_TRUE(sendAll(ours, std::as_bytes(std::span(text))));
  ours.close();
  EXPECT_EQ(child.wait(kPatient), 7);
  EXPECT_EQ(contents(folder / "said"), text);
}

TEST(ChildProcesses, ThatHaveEndedAreNoSignal) {
  auto [ours, theirs] = connectedPair();
  ChildProcess child = shell("exit 0", theirs);
  theirs.close();
  EXPECT_EQ(child.wait(kPatient), 0);
  const std::string text = "too late";
  EXPECT_FALSE(sendAll(ours, std::as_bytes(std::span(text))));
}

TEST(ChildProcesses, AreKilledWithWhatTheyStarted) {
  auto [ours, theirs] = connectedPair();
  {
    // Both hold the connection: it ends when both have gone.
    ChildProcess child = shell("sleep 1000 & sleep 1000", theirs);
    theirs.close();
    EXPECT_FALSE(child.wait(std::chrono::milliseconds(50)));
  }
  char byte = 0;
  EXPECT_EQ(recv(ours.number(), &byte, 1, 0), 0);
}

TEST(ScratchFolders, GoWithTheirOwner) {
  std::filesystem::path path;
  {
    const ScratchFolder folder;
    path = folder.path();
    ASSERT_TRUE(std::filesystem::is_directory(path));
    std::ofstream(path / "file") << "something";
  }
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(ScratchFolders, GoWithAProcessThatIsKilled) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  const pid_t process = fork();
  if (process == 0) {
    const ScratchFolder folder;
    std::ofstream(folder.path() / "file") << "something";
    const std::string name = folder.path().string();
    if (write(ends[1], name.data(), name.size()) < 0) _exit(1);
    close(ends[1]);
    while (true)
      pause();
  }
  close(ends[1]);
  std::string name(1000, '\0');
  const ssize_t size = read(ends[0], name.data(), name.size());
  ASSERT_GT(size, 0);
  name.resize(static_cast<std::size_t>(size));
  EXPECT_TRUE(std::filesystem::exists(name));
  kill(process, SIGKILL);
  waitpid(process, nullptr, 0);
  const auto until = std::chrono::steady_clock::now() + kPatient;
  while (std::filesystem::exists(name) && std::chrono::steady_clock::now() < until)
    usleep(10'000);
  EXPECT_FALSE(std::filesystem::exists(name));
  close(ends[0]);
}

TEST(Programs, AreFoundInTheOrderOfTheirNames) {
  EXPECT_EQ(findProgram({"no-such-program-here", "/bin/sh"}), "/bin/sh");
  EXPECT_EQ(findProgram({"sh"}).filename(), "sh");
  EXPECT_TRUE(findProgram({"no-such-program-here", "/bin"}).empty());
}

}  // namespace
}  // namespace carom::lab
