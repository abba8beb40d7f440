#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "command/output/kept_inputs.h"
#include "command/output/output_target.h"
#include "command/progress_bar.h"
#include "command/run_options.h"

#include "carom/audio/result.h"
#include "scenes/format/scene.h"
#include "scenes/limits/incomplete_names.h"
#include "scenes/run/jello_run.h"

namespace CLI {
class App;
}

namespace carom::command {

using namespace scenes;

/// `carom jello`: runs a jello, and writes its sound, its trajectory and its energies.
class JelloCommand {
 public:
  /// Adds the command to `app`; must outlive the parsing.
  explicit JelloCommand(CLI::App& app);
  bool parsed() const;
  /// Returns the program's exit code.
  int run() const;

 private:
  Result<Scene> readScene() const;
  std::vector<WrittenFile> written() const;
  Status checkOutputs() const;
  void applyStepping(JelloShape& jello) const;
  int writeModes(const Scene& scene, ResourceWatch& watch) const;
  JelloOptions optionsFor(RunGuard& guard, ProgressBar& bar, const std::string& sound,
                          IncompleteNames& names) const;
  int runScene(const Scene& scene, const OutputTarget& target, const RunLimits& limits) const;

  CLI::App* command_;
  std::string world_;
  std::string output_;
  std::string trajectory_;
  std::string energy_;
  std::string modes_;
  std::string integrator_;  // empty: the world's own
  std::string listener_;    // empty: the scene's own
  std::string fullScale_;
  double step_ = 0.0;        // s; 0: the world's own
  double error_ = 0.0;       // m; 0: the world's own
  double seconds_ = 0.0;     // s; 0: the scene's own
  double sampleRate_ = 0.0;  // Hz; 0: the scene's own
  bool normalize_ = false;
  bool json_ = false;
  RunOptions run_;
  bool confine_ = false;
};

}  // namespace carom::command
