#pragma once

#include <cstdio>
#include <string_view>

namespace carom::bench {

/// A program that prints a table and takes no arguments but --help.
struct TableProgram {
  const char* name;  ///< of the program
  const char* help;
  int (*run)();

  int main(int argc, char** argv) const {
    if (argc == 1) return run();
    const bool asked = std::string_view(argv[1]) == "--help";
    if (!asked) std::fprintf(stderr, "%s: what is '%s'?\n\n", name, argv[1]);
    std::fputs(help, asked ? stdout : stderr);
    return asked ? 0 : 2;
  }
};

}  // namespace carom::bench
