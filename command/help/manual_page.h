#pragma once

#include <string>

#include "command/help/command_help.h"

namespace carom::command {

/// Returns the manual page, for man(7), of the program or of one of its commands, whose own
/// commands are sections of it. Its date is that of SOURCE_DATE_EPOCH, if that is set.
std::string manualPage(const CommandHelp& program, const CommandHelp& command);

}  // namespace carom::command
