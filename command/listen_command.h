#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace carom::command {

/// `carom listen`: runs a program that links Bullet dynamically, and records what its worlds sound
/// like, without a change to it. The sound itself is made in the program, by plugin/listen, which
/// is preloaded.
class ListenCommand {
 public:
  /// Adds the command to `app`; must outlive the parsing. `program` is the program and its
  /// arguments, as they stand behind `--`.
  ListenCommand(CLI::App& app, std::vector<std::string> program);
  bool parsed() const;
  /// Returns the program's exit code, or 128 and the number of the signal that ended it; those of
  /// this program if it was not started.
  int run() const;

 private:
  std::string fault() const;
  std::vector<std::string> variables(const std::string& preloaded, const std::string& folder) const;

  CLI::App* command_;
  std::vector<std::string> program_;
  std::string output_;
  std::string fullScale_;
  std::string listener_;
  double units_ = 1.0;  // m
  bool play_ = false;
  bool json_ = false;
};

/// Takes the program and its arguments off a command line `carom listen ... -- PROGRAM ARGS...`,
/// before any of it can be taken for an option of ours; nothing of other commands' lines.
std::vector<std::string> takeProgram(int& argc, char** argv);

}  // namespace carom::command
