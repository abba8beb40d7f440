#include "command/signals.h"

#if __has_include(<unistd.h>)
#include <csignal>
#include <cstdio>
#include <thread>

#include <pthread.h>

#include "audio/io/partial_file.h"

namespace carom::command {
namespace {

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

// The signals are blocked in all threads, and one waits for them: unlike a handler, it may do
// anything.
void endOnSignals(const char* words) {
  std::signal(SIGXFSZ, SIG_IGN);
  sigset_t ending;
  sigemptyset(&ending);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP})
    if (!isIgnored(signal)) sigaddset(&ending, signal);
  pthread_sigmask(SIG_BLOCK, &ending, nullptr);
  std::thread([ending, words] {
    int signal = 0;
    if (sigwait(&ending, &signal) != 0) return;
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

}  // namespace carom::command
#else
namespace carom::command {
void endCleanlyOnSignals() {}
void endSilentlyOnSignals() {}
}  // namespace carom::command
#endif
