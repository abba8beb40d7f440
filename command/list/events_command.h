#pragma once

#include <string>
#include <vector>

#include "command/list/collision_list.h"
#include "command/run_options.h"

namespace CLI {
class App;
}

namespace carom::command {

/// `carom events`: lists the collisions of a scene, a recorded run or an events file.
class EventsCommand {
 public:
  /// Adds the command to `app`; must outlive the parsing.
  explicit EventsCommand(CLI::App& app);
  bool parsed() const;
  /// Returns the program's exit code.
  int run() const;

 private:
  int answerWith(const std::string& rows) const;

  CLI::App* command_;
  std::string input_;
  double loudest_ = 0.0;  // how many; 0: all, in order of time
  bool confine_ = false;
  bool json_ = false;
  RunOptions run_;
};

}  // namespace carom::command
