#pragma once

#include <csignal>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/scenes/library.h"
#include "tests/support/temporary_folder.h"

namespace carom::test {

struct Outcome {
  int code = -1;  ///< exit code; 1000 + the number of the signal that killed it
  std::string out;
  std::string err;
};

struct RunSettings {
  rlim_t largestFile = RLIM_INFINITY;  ///< bytes; writing fails beyond, as on a full disk
  std::string out = {};                ///< file for standard output; captured if empty
  int err = -1;                        ///< descriptor for standard error; captured if negative
  std::filesystem::path folder = {};   ///< the current folder of the program; the test's if empty
  int outDescriptor = -1;              ///< descriptor for standard output, before `out`
};

inline int openForWriting(const std::filesystem::path& path) {
  return open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
}

/// Replaces the child process by `carom`.
[[noreturn]] inline void become(std::vector<std::string> arguments, int out, int err,
                                rlim_t largestFile) {
  dup2(out, STDOUT_FILENO);
  dup2(err, STDERR_FILENO);
  const rlimit limit = {largestFile, largestFile};
  setrlimit(RLIMIT_FSIZE, &limit);
  std::signal(SIGXFSZ, SIG_IGN);
  arguments.insert(arguments.begin(), "carom");
  std::vector<char*> pointers;
  pointers.reserve(arguments.size() + 1);
  for (std::string& argument : arguments)
    pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  execv(CAROM_COMMAND, pointers.data());
  _exit(127);
}

/// Runs the built command and waits for it.
inline Outcome carom(const std::vector<std::string>& arguments, const RunSettings& settings = {}) {
  const TemporaryFolder folder;
  const std::filesystem::path outFile =
      settings.out.empty() ? folder / "out" : std::filesystem::path(settings.out);
  const int out = settings.outDescriptor >= 0 ? settings.outDescriptor : openForWriting(outFile);
  const int err = settings.err >= 0 ? settings.err : openForWriting(folder / "err");
  const pid_t child = fork();
  if (child == 0) {
    if (!settings.folder.empty() && chdir(settings.folder.c_str()) != 0) _exit(126);
    become(arguments, out, err, settings.largestFile);
  }
  int status = 0;
  waitpid(child, &status, 0);
  if (settings.outDescriptor < 0) close(out);
  Outcome outcome;
  outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
  if (settings.out.empty() && settings.outDescriptor < 0) outcome.out = contents(outFile);
  if (settings.err < 0) {
    close(err);
    outcome.err = contents(folder / "err");
  }
  return outcome;
}

inline std::string library(std::string_view name) {
  return libraryFile(name).string();
}

/// Expects an exit with `code`, a message and no output; returns the message.
inline std::string expectRefused(const std::vector<std::string>& arguments, int code) {
  const Outcome outcome = carom(arguments);
  const std::string command = testing::PrintToString(arguments);
  EXPECT_EQ(outcome.code, code) << command << outcome.err;
  EXPECT_EQ(outcome.out, "") << command;
  EXPECT_FALSE(outcome.err.empty()) << command;
  return outcome.err;
}

inline nlohmann::json parsed(const Outcome& outcome) {
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  nlohmann::json object =
      nlohmann::json::parse(outcome.out, nullptr, false);  // refuses anything after the object
  EXPECT_TRUE(object.is_object()) << outcome.out;
  return object;
}

}  // namespace carom::test
