#include "command/terminal/terminal.h"

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <string_view>

#include <sys/ioctl.h>
#include <unistd.h>

#include "modal/json/json_reader.h"

namespace carom::command {
namespace {

constexpr std::size_t kNarrowest = 60;
constexpr std::size_t kWidest = 100;
constexpr std::size_t kUsual = 80;

/// Returns the variable of the environment; empty if it is not set.
std::string_view variable(const char* name) {
  const char* const value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): one thread
  return value != nullptr ? value : std::string_view();
}

const char* codeOf(Style style) {
  switch (style) {
    case Style::heading:
      return "\033[1m";
    case Style::name:
      return "\033[36m";
    case Style::error:
      return "\033[1;31m";
    case Style::warning:
      return "\033[33m";
  }
  return "";
}

}  // namespace

Talk& talk() {
  static Talk ours;
  return ours;
}

bool hasColour(Stream stream) {
  if (!variable("NO_COLOR").empty()) return false;
  const std::string_view forced = variable("CLICOLOR_FORCE");
  if (!forced.empty() && forced != "0") return true;
  if (variable("TERM") == "dumb" || variable("TERM").empty()) return false;
  return isatty(stream == Stream::out ? STDOUT_FILENO : STDERR_FILENO) == 1;
}

std::string styled(const std::string& text, Style style, Stream stream) {
  return hasColour(stream) ? codeOf(style) + text + "\033[0m" : text;
}

std::size_t textWidth() {
  winsize size{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return kUsual;
  return std::clamp<std::size_t>(size.ws_col, kNarrowest, kWidest);
}

void warn(const std::string& text) {
  std::cerr << styled("carom:", Style::warning, Stream::err) << ' ' << modal::withoutControls(text)
            << '\n';
}

}  // namespace carom::command
