#pragma once

#include <string>

namespace CLI {
class App;
}

namespace carom::command {

/// `carom materials`: lists the built-in materials, or says all of one.
class MaterialsCommand {
 public:
  /// Adds the command to `app`; must outlive the parsing.
  explicit MaterialsCommand(CLI::App& app);
  bool parsed() const;
  /// Returns the program's exit code.
  int run() const;

 private:
  int list() const;
  int one() const;

  CLI::App* command_;
  std::string name_;  // empty: all
  bool json_ = false;
};

}  // namespace carom::command
