#include "command/signals.h"

#if __has_include(<unistd.h>)
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <thread>

#include <fcntl.h>
#include <pthread.h>
#include <unistd.h>

#include "audio/io/partial_file.h"

namespace carom::command {
namespace {

/// The signals as they were before endOnSignals, for a program that this one starts.
struct SignalsBefore {
  sigset_t mask = {};
  struct sigaction fileSize = {};
  struct sigaction pipe = {};
  bool isKnown = false;
};
SignalsBefore before;

std::atomic<pid_t> receiver{0};

/// Ends the program by a signal, with its default action.
void endBy(int signal) {
  std::signal(signal, SIG_DFL);
  sigset_t one;
  sigemptyset(&one);
  sigaddset(&one, signal);
  std::raise(signal);
  pthread_sigmask(SIG_UNBLOCK, &one, nullptr);
}

bool isIgnored(int signal) {
  struct sigaction now = {};
  return sigaction(signal, nullptr, &now) == 0 && now.sa_handler == SIG_IGN;
}

/// Hands a signal on. The terminal sends its own to all processes in the foreground.
void handOn(const siginfo_t& signal, pid_t process) {
  if (signal.si_code <= 0) kill(process, signal.si_signo);
}

/// Waits for a signal for this process; those for another one are handed on.
int awaitOwn(const sigset_t& signals) {
  for (;;) {
    siginfo_t info{};
    const int signal = sigwaitinfo(&signals, &info);
    if (signal < 0 && errno == EINTR) continue;
    const pid_t process = receiver.load();
    if (signal < 0 || process == 0) return signal;
    handOn(info, process);
  }
}

// The signals are blocked in all threads, and one waits for them: unlike a handler, it may do
// anything.
void endOnSignals(const char* words) {
  sigaction(SIGXFSZ, nullptr, &before.fileSize);
  sigaction(SIGPIPE, nullptr, &before.pipe);
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  sigset_t ending;
  sigemptyset(&ending);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGXCPU})
    if (!isIgnored(signal)) sigaddset(&ending, signal);
  pthread_sigmask(SIG_BLOCK, &ending, &before.mask);
  before.isKnown = true;
  std::thread([ending, words] {
    const int signal = awaitOwn(ending);
    if (signal <= 0) return;
    audio::PartialFile::removeAll();
    std::fputs(words, stderr);
    endBy(signal);
  }).detach();
}

}  // namespace

void keepStandardStreams() {
  constexpr std::array kModes = {O_RDONLY, O_RDONLY, O_WRONLY};
  for (int stream = STDIN_FILENO; stream <= STDERR_FILENO; ++stream)
    if (fcntl(stream, F_GETFD) < 0 && errno == EBADF)
      (void)open("/dev/null", kModes[static_cast<std::size_t>(stream)]);  // gets the lowest number
}

void endAsWithoutReader() {
  audio::PartialFile::removeAll();
  endBy(SIGPIPE);
}

void endCleanlyOnSignals() {
  endOnSignals("carom: interrupted; what was under way is not written\n");
}

void endSilentlyOnSignals() {
  endOnSignals("");
}

void handSignalsTo(int process) {
  receiver = process;
}

void restoreSignals() {
  if (!before.isKnown) return;
  sigaction(SIGXFSZ, &before.fileSize, nullptr);
  sigaction(SIGPIPE, &before.pipe, nullptr);
  sigprocmask(SIG_SETMASK, &before.mask, nullptr);
}

}  // namespace carom::command
#else
namespace carom::command {
void keepStandardStreams() {}
void endAsWithoutReader() {}
void endCleanlyOnSignals() {}
void endSilentlyOnSignals() {}
void handSignalsTo(int) {}
void restoreSignals() {}
}  // namespace carom::command
#endif
