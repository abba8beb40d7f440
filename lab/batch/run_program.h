#pragma once

#include <string>
#include <vector>

namespace carom::lab {

/// Runs a program that is looked for in PATH, with this one's files, and waits for it. Returns its
/// exit code; -1 if there is no such program, or if a signal has ended it.
int runProgram(std::vector<std::string> words);

}  // namespace carom::lab
