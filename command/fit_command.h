#pragma once

#include <string>
#include <vector>

#include "command/run_options.h"

#include "carom/audio/material.h"
#include "carom/audio/result.h"
#include "scenes/limits/resource_watch.h"

namespace CLI {
class App;
}

namespace carom::lab {
struct FitOutcome;
}

namespace carom::command {

/// `carom fit`: the material of an object, and how it rings, from recordings of taps on it.
class FitCommand {
 public:
  /// Adds the command to `app`; must outlive the parsing.
  explicit FitCommand(CLI::App& app);
  bool parsed() const;
  /// Returns the program's exit code.
  int run() const;

 private:
  void addBody();
  Status checkOptions() const;
  Status checkKept() const;
  Result<Material> startMaterial() const;
  int readTaps(lab::FitOutcome& outcome, scenes::ResourceWatch& watch) const;
  int fitMesh(lab::FitOutcome& outcome, scenes::ResourceWatch& watch) const;
  int modelAlone(lab::FitOutcome& outcome) const;

  CLI::App* command_;
  std::vector<std::string> taps_;
  std::string mesh_;
  std::string material_;
  std::string free_;
  std::string output_;
  std::string cacheFolder_;
  double scale_ = 1.0;
  double density_ = 0.0;  // kg/m^3; 0: the material's
  double mass_ = 0.0;     // kg; 0: not known
  double radius_ = 0.0;   // m; 0: by the mass
  double panels_ = 800.0;
  bool noCache_ = false;
  bool json_ = false;
  RunOptions run_;
};

}  // namespace carom::command
