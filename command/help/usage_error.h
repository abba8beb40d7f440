#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
class Error;
}  // namespace CLI

namespace carom::command {

/// Returns the command that was parsed last: `app` itself if none was.
CLI::App& parsedCommand(CLI::App& app);

/// Returns the words that call the command: "batch", "run".
std::vector<std::string> wordsOf(const CLI::App& command);

/// Returns the answer to a wrong command line, in whole lines: what is wrong, the nearest command
/// or option if a word is none, and where to read what is expected. A word that is none comes
/// before all other errors, which may follow from it.
std::string usageErrorText(CLI::App& app, const CLI::Error& error);

/// Returns "unknown command 'rendr' (did you mean 'render'?)", of the commands of `app`.
std::string unknownCommand(CLI::App& app, const std::string& word);

}  // namespace carom::command
