#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "command/run_options.h"

namespace CLI {
class App;
}

namespace carom::command {

/// `carom report`: runs scenes in all ways that make a difference, and reports the cost and the
/// error of each.
class ReportCommand {
 public:
  /// Adds the command to `app`; must outlive the parsing.
  explicit ReportCommand(CLI::App& app);
  bool parsed() const;
  /// Returns the program's exit code.
  int run() const;

 private:
  CLI::App* command_;
  std::vector<std::string> scenes_;
  std::string output_;
  std::string template_;
  std::size_t runs_ = 3;
  double budget_ = 10.0;  // s
  bool json_ = false;
  bool confine_ = true;
  bool noView_ = false;
  RunOptions run_;
};

}  // namespace carom::command
