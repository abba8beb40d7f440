#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace carom::command {

/// `carom help`: says what the program and its commands take; makes their manual pages.
class HelpCommand {
 public:
  /// Adds the command to `app`, which must outlive this object; this must outlive the parsing.
  explicit HelpCommand(CLI::App& app);
  bool parsed() const;
  /// Returns the program's exit code.
  int run() const;

 private:
  CLI::App& app_;
  CLI::App* command_;
  std::vector<std::string> words_;
  std::string pages_;  // folder for manual pages and completions; empty: none
};

}  // namespace carom::command
