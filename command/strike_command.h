#pragma once

#include <string>

#include "command/run_options.h"

namespace CLI {
class App;
}

namespace carom::command {

/// `carom strike`: renders one impact on a body that rings into a WAV file.
class StrikeCommand {
 public:
  /// Adds the command to `app`; must outlive the parsing.
  explicit StrikeCommand(CLI::App& app);
  bool parsed() const;
  /// Returns the program's exit code.
  int run() const;

 private:
  CLI::App* command_;
  std::string model_;
  std::string node_;
  std::string at_;
  std::string impulse_;
  std::string listener_ = "0,0,1";
  std::string output_;
  std::string fullScale_;
  std::string radiation_ = "directional";
  std::string hammerMaterial_ = "steel";
  double hammerMass_ = 0.02;    // kg
  double hammerRadius_ = 0.01;  // m
  double duration_ = 0.0;       // s; 0: until the sound has ended
  double sampleRate_ = 48000.0;
  bool normalize_ = false;
  bool noClick_ = false;
  bool json_ = false;
  RunOptions run_;
};

}  // namespace carom::command
