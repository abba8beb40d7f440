#pragma once

#include <cstdio>
#include <string_view>

#include "tests/bench/scale.h"

namespace carom::bench {

/// A program that prints a table and takes no arguments but --help and --short.
struct TableProgram {
  const char* name;  ///< the program's
  const char* help;
  int (*run)(const Scale&);

  int main(int argc, char** argv) const {
    const Scale scale = scaleOf(argc, argv);
    if (argc == 1 || (argc == 2 && scale.isShort)) return run(scale);
    const bool asked = std::string_view(argv[1]) == "--help";
    if (!asked) std::fprintf(stderr, "%s: what is '%s'?\n\n", name, argv[1]);
    std::fputs(help, asked ? stdout : stderr);
    return asked ? 0 : 2;
  }
};

}  // namespace carom::bench
