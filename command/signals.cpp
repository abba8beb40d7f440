#include "command/signals.h"

#if __has_include(<unistd.h>)
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <thread>

#include <pthread.h>

#include "audio/io/partial_file.h"

namespace carom::command {
namespace {

/// The signals as they were before endOnSignals, for a program that this one starts.
struct SignalsBefore {
  sigset_t mask = {};
  struct sigaction fileSize = {};
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
  std::signal(SIGXFSZ, SIG_IGN);
  sigset_t ending;
  sigemptyset(&ending);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP})
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
  sigprocmask(SIG_SETMASK, &before.mask, nullptr);
}

}  // namespace carom::command
#else
namespace carom::command {
void endCleanlyOnSignals() {}
void endSilentlyOnSignals() {}
void handSignalsTo(int) {}
void restoreSignals() {}
}  // namespace carom::command
#endif
