#pragma once

#include <string>

#include "command/help/command_help.h"

namespace carom::command {

// Scripts by which shells complete the words of a command line: commands, options, and what they
// take. Scenes and materials are asked for by the shell when it completes, as `carom scenes -q`.

std::string bashCompletion(const CommandHelp& program);
/// For `site-functions/_carom`, and to be sourced.
std::string zshCompletion(const CommandHelp& program);
std::string fishCompletion(const CommandHelp& program);

}  // namespace carom::command
