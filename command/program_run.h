#pragma once

#include <string>
#include <vector>

#include "carom/audio/result.h"

namespace carom::command {

/// Runs a program, found as a shell finds it, with that environment ("NAME=value"), and waits for
/// it. Meanwhile the signals that would end this process go to the program, which gets the signals
/// and the limit of memory that this one was started with. Returns its exit code, or 128 and the
/// number of the signal that ended it, as shells do. Refuses what cannot be started.
Result<int> runListened(const std::vector<std::string>& program,
                        const std::vector<std::string>& environment);

}  // namespace carom::command
