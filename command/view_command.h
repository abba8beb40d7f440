#pragma once

#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "command/run_options.h"
#include "lab/view/view_page.h"
#include "lab/view/view_run.h"

#include "carom/audio/result.h"
#include "scenes/format/scene.h"
#include "scenes/limits/run_guard.h"

namespace CLI {
class App;
}

namespace carom::command {

/// `carom view`: writes a page in which scenes and recorded runs are seen and heard.
class ViewCommand {
 public:
  /// Adds the command to `app`; must outlive the parsing.
  explicit ViewCommand(CLI::App& app);
  bool parsed() const;
  /// Returns the program's exit code.
  int run() const;

 private:
  CLI::App* command_;
  std::vector<std::string> inputs_;
  std::vector<std::string> labels_;
  std::string output_;  // empty: the first input's name with .html
  std::string template_;
  std::string stepper_;
  double step_ = 0.0;     // s; 0: the scene's own
  double seconds_ = 0.0;  // s; 0: all of a scene
  bool compare_ = false;
  bool noOpen_ = false;
  bool confine_ = false;
  bool json_ = false;
  RunOptions run_;
};

/// Returns the folders in which the template of `carom view` may be, by the place of this program.
std::vector<std::filesystem::path> pageFolders();

/// Gives a page the default head, if it is installed; without it, the page has no binaural ears.
/// Errors: those of ViewPage::setHead.
Status addDefaultHead(lab::ViewPage& page);

/// The exit code of a run that cannot be made, after the message has been said.
struct NoView {
  int code = 1;
};
using MadeView = std::variant<lab::ViewRun, NoView>;

/// Reads a recorded run of any kind, with a bar of progress.
MadeView readView(const std::string& file, bool isConfined, const scenes::RunLimits& limits);
/// Runs a scene of a file within limits, with a bar of progress; of `options` the rest.
MadeView runView(const std::string& file, const scenes::Scene& scene,
                 const scenes::RunLimits& limits, lab::ViewOptions options = {});

}  // namespace carom::command
