#include "command/progress_bar.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <utility>

#include "command/terminal/terminal.h"
#include <unistd.h>

namespace carom::command {

ProgressBar::ProgressBar(std::string label)
    : label_(std::move(label)), terminal_(isatty(STDERR_FILENO) == 1) {}

ProgressBar::~ProgressBar() {
  clear();
}

void ProgressBar::clear() {
  if (!terminal_ || shown_ < 0) return;
  std::fputs("\r\033[K", stderr);
  std::fflush(stderr);
  shown_ = -1;
}

void ProgressBar::show(double share, const std::string& note) {
  constexpr int kWidth = 30;
  const int percent = static_cast<int>(100.0 * std::clamp(share, 0.0, 1.0));
  if (talk().isQuiet()) return;
  if (!terminal_) showLine(percent, note);
  if (!terminal_ || (percent == shown_ && note == note_)) return;
  shown_ = percent;
  note_ = note;
  const auto done = static_cast<std::size_t>(kWidth * percent / 100);
  const std::string bar = std::string(done, '#') + std::string(kWidth - done, '.');
  const std::string words = note.empty() ? "" : ", " + note;
  std::fprintf(stderr, "\r%s [%s] %3d %%%s\033[K", label_.c_str(), bar.c_str(), percent,
               words.c_str());
  std::fflush(stderr);
}

/// Writes a line now and then, for who reads a log: none in a run of less than kLinePeriod.
void ProgressBar::showLine(int percent, const std::string& note) {
  constexpr std::chrono::seconds kLinePeriod(30);
  const auto now = std::chrono::steady_clock::now();
  if (now - lineAt_ < kLinePeriod) return;
  lineAt_ = now;
  const std::string words = note.empty() ? "" : ", " + note;
  std::fprintf(stderr, "%s: %d %%%s\n", label_.c_str(), percent, words.c_str());
}

}  // namespace carom::command
