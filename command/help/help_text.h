#pragma once

#include <cstddef>
#include <string>

#include "command/help/command_help.h"

namespace carom::command {

/// Returns the short overview of `carom` alone: which commands there are.
std::string overviewText(const CommandHelp& program, std::size_t width);

/// Returns the help of a command, or of the program: its use, arguments, options by groups with
/// what they take, what is accepted and what stands without them, and examples. Lines have at most
/// `width` letters unless a word is longer. Headings are coloured if standard output is a terminal.
std::string helpText(const CommandHelp& help, std::size_t width);

/// Returns the description of an option as one sentence, with its range and its default.
std::string sentenceOf(const OptionHelp& option);

}  // namespace carom::command
