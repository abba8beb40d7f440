#pragma once

#include <string>

#include "command/run_options.h"

#include "carom/audio/result.h"
#include "scenes/format/scene.h"
#include "scenes/limits/resource_watch.h"

namespace CLI {
class App;
}

namespace carom::lab {
struct FilmSettings;
struct ViewRun;
}  // namespace carom::lab

namespace carom::command {

/// The command `carom video`: a film of a scene, or of a run that was recorded.
class VideoCommand {
 public:
  /// Adds the command to `app`, which must not outlive this object.
  explicit VideoCommand(CLI::App& app);
  VideoCommand(const VideoCommand&) = delete;
  VideoCommand& operator=(const VideoCommand&) = delete;

  bool parsed() const;
  int run() const;

 private:
  void addPicture();
  void addSound();
  void addPrograms();
  Status checkOutput() const;
  Result<scenes::Scene> chosenScene() const;
  Result<lab::FilmSettings> settingsFor(const scenes::Scene& scene) const;
  int film(lab::ViewRun view, lab::FilmSettings settings, scenes::ResourceWatch& watch) const;

  CLI::App* command_;
  std::string input_;
  std::string output_;
  std::string size_ = "1280x720";
  int rate_ = 60;
  double from_ = 0.0;  // s
  double to_ = 0.0;    // s; 0: the end
  double speed_ = 1.0;
  double tail_ = 0.0;     // s
  std::string camera_;    // file; empty: the scene's
  std::string listener_;  // name; empty: the camera's ear
  std::string ear_ = "pair";
  std::string fullScale_;  // empty: automatic
  std::string theme_ = "dark";
  std::string stepper_;  // empty: the scene's
  double step_ = 0.0;    // s; 0: the scene's
  bool captions_ = false;
  bool meter_ = false;
  bool lossless_ = false;
  std::string browser_;   // empty: looked for
  std::string encoder_;   // empty: looked for
  std::string template_;  // empty: looked for
  bool confine_ = false;
  bool json_ = false;
  RunOptions run_;
};

}  // namespace carom::command
