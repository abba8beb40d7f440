#pragma once

#include <string>

namespace CLI {
class App;
}

namespace carom::command {

/// `carom completion`: prints what makes a shell complete the program's words.
class CompletionCommand {
 public:
  /// Adds the command to `app`, which must outlive this object; this must outlive the parsing.
  explicit CompletionCommand(CLI::App& app);
  bool parsed() const;
  /// Returns the program's exit code.
  int run() const;

 private:
  CLI::App& app_;
  CLI::App* command_;
  std::string shell_;
};

}  // namespace carom::command
