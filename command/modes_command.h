#pragma once

#include <string>
#include <vector>

#include "command/run_options.h"

namespace CLI {
class App;
}

namespace carom::command {

/// `carom modes`: computes a model file, and a table of its modes, from a mesh.
class ModesCommand {
 public:
  /// Adds the command to `app`; must outlive the parsing.
  explicit ModesCommand(CLI::App& app);
  bool parsed() const;
  /// Returns the program's exit code.
  int run() const;

 private:
  CLI::App* command_;
  std::string mesh_;
  std::string output_;
  std::string material_;
  std::string springs_ = "transverse";
  std::string cacheFolder_;
  double scale_ = 1.0;
  double thickness_ = 0.0;         // mm; 0: a solid
  double accuracy_ = 1.0;          // percent
  double degreesOfFreedom_ = 0.0;  // 0: by accuracy
  double modes_ = 60.0;
  double panels_ = 800.0;
  bool solid_ = false;
  bool noRadiation_ = false;
  bool noCache_ = false;
  bool json_ = false;
  RunOptions run_;
};

}  // namespace carom::command
