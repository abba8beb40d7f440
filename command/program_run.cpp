#include "command/program_run.h"

#include <cerrno>
#include <cstddef>
#include <cstring>

#include "command/run_options.h"
#include "command/signals.h"
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace carom::command {
namespace {

constexpr int kBySignal = 128;
constexpr int kNotStarted = 127;

std::vector<char*> pointersTo(const std::vector<std::string>& words) {
  std::vector<char*> pointers;
  pointers.reserve(words.size() + 1);
  for (const std::string& word : words)
    pointers.push_back(const_cast<char*>(word.c_str()));
  pointers.push_back(nullptr);
  return pointers;
}

/// Becomes the program, or tells through the pipe why that cannot be. [in the child]
[[noreturn]] void becomeProgram(char* const* program, char* const* environment, int failurePipe) {
  restoreSignals();
  liftMemoryCap();
  execvpe(program[0], program, environment);
  const int failure = errno;
  [[maybe_unused]] const ssize_t told = write(failurePipe, &failure, sizeof failure);
  _exit(kNotStarted);
}

/// Waits until a process has ended, and leaves its number taken, so that no signal goes astray.
void awaitEnd(pid_t process) {
  siginfo_t ignored{};
  while (waitid(P_PID, static_cast<id_t>(process), &ignored, WEXITED | WNOWAIT) != 0)
    if (errno != EINTR) return;
}

}  // namespace

Result<int> runListened(const std::vector<std::string>& program,
                        const std::vector<std::string>& environment) {
  const std::vector<char*> words = pointersTo(program);
  const std::vector<char*> variables = pointersTo(environment);
  int failurePipe[2] = {-1, -1};
  if (pipe2(failurePipe, O_CLOEXEC) != 0) return Error{std::strerror(errno)};
  const pid_t process = fork();
  if (process == 0) becomeProgram(words.data(), variables.data(), failurePipe[1]);
  const int forkFailure = errno;
  close(failurePipe[1]);
  if (process < 0) {
    close(failurePipe[0]);
    return Error{std::strerror(forkFailure)};
  }
  handSignalsTo(process);
  int failure = 0;
  const bool hasFailed =
      read(failurePipe[0], &failure, sizeof failure) == static_cast<ssize_t>(sizeof failure);
  close(failurePipe[0]);
  awaitEnd(process);
  handSignalsTo(0);
  int status = 0;
  waitpid(process, &status, 0);
  if (hasFailed) return Error{std::strerror(failure)};
  return WIFEXITED(status) ? WEXITSTATUS(status) : kBySignal + WTERMSIG(status);
}

}  // namespace carom::command
