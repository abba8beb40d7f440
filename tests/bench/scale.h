#pragma once

#include <algorithm>
#include <span>
#include <string_view>

namespace carom::bench {

/// The amount of work that a benchmark does: all that its published figures need, or, with
/// `--short`, the least that runs the same code and still shows a figure that has fallen to half.
struct Scale {
  bool isShort = false;

  template <class T>
  T of(T whole, T shortened) const {
    return isShort ? shortened : whole;
  }
};

inline Scale scaleOf(int argc, char** argv) {
  const std::span arguments(argv, static_cast<std::size_t>(argc));
  const auto isShort = [](const char* argument) { return argument == std::string_view("--short"); };
  return {.isShort = std::ranges::any_of(arguments, isShort)};
}

}  // namespace carom::bench
