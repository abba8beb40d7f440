#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace carom::command {

/// `carom scenes`: lists the scenes of the library.
class ScenesCommand {
 public:
  /// Adds the command to `app`; must outlive the parsing.
  explicit ScenesCommand(CLI::App& app);
  bool parsed() const;
  /// Returns the program's exit code.
  int run() const;

 private:
  CLI::App* command_;
  std::vector<std::string> names_;  // empty: all
  bool paths_ = false;
  bool json_ = false;
};

}  // namespace carom::command
