#pragma once

#include <string>

#include "command/run_options.h"
#include "lab/stability/stability.h"

namespace CLI {
class App;
}

namespace carom::command {

using namespace lab;

/// `carom stability`: runs stiff and extreme cases, and says what theory expects of each.
class StabilityCommand {
 public:
  /// Adds the command to `app`; must outlive the parsing.
  explicit StabilityCommand(CLI::App& app);
  bool parsed() const;
  /// Returns the program's exit code: 1 if a case fails.
  int run() const;

 private:
  StabilityForm form() const { return short_ ? StabilityForm::brief : StabilityForm::full; }
  int list(const std::vector<StabilityCase>& cases) const;

  CLI::App* command_;
  std::string only_;
  std::string output_;
  bool short_ = false;
  bool list_ = false;
  bool json_ = false;
  RunOptions run_;
};

}  // namespace carom::command
