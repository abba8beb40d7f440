#include "command/listen_command.h"

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>

#include "command/command_line.h"
#include "command/listen_outcome.h"
#include "command/output/output_target.h"
#include "command/program_run.h"
#include "command/terminal/terminal.h"
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "audio/io/partial_file.h"
#include "plugin/listen/listen_protocol.h"

namespace carom::command {

namespace fs = std::filesystem;

namespace {

constexpr const char* kPreloaded = "libcarom_listen.so";
constexpr std::size_t kPoseNumbers = 7;

/// Parses "x,y,z" or "x,y,z,qx,qy,qz,qw" into seven numbers with a unit quaternion; nothing if the
/// text is anything else.
std::optional<std::array<double, kPoseNumbers>> listenerPose(const std::string& text) {
  std::array<double, kPoseNumbers> pose = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0};
  std::istringstream parts(text);
  std::size_t count = 0;
  for (std::string part; std::getline(parts, part, ','); ++count)
    if (count >= kPoseNumbers || !CLI::detail::lexical_cast(part, pose[count]) ||
        !(std::abs(pose[count]) <= kFarthestListener))
      return std::nullopt;
  if ((count != 3 && count != kPoseNumbers) || text.ends_with(',')) return std::nullopt;
  const double length = std::hypot(std::hypot(pose[3], pose[4]), std::hypot(pose[5], pose[6]));
  if (!(length >= 1e-6)) return std::nullopt;
  for (std::size_t part = 3; part < kPoseNumbers; ++part)
    pose[part] /= length;
  return pose;
}

CLI::Validator poseRange() {
  const auto check = [](const std::string& text) -> std::string {
    if (listenerPose(text)) return {};
    return "'" + text +
           "' is no place; expected x,y,z (metres, -1e6 to 1e6), or with an orientation "
           "x,y,z,qx,qy,qz,qw";
  };
  return {check, "X,Y,Z", "three numbers of metres, or x,y,z,qx,qy,qz,qw"};
}

/// Returns the library to preload, by the place of this program; nothing if it is not there.
std::optional<fs::path> preloadedLibrary() {
  std::error_code ignored;
  const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
  std::istringstream folders(CAROM_LISTEN_FOLDERS);
  for (std::string folder; std::getline(folders, folder, ':');) {
    const fs::path library = (program.parent_path() / folder / kPreloaded).lexically_normal();
    if (fs::is_regular_file(library, ignored)) return library;
  }
  return std::nullopt;
}

/// A new folder of this process's own, removed at the end.
class ReportFolder {
 public:
  ReportFolder() {
    std::error_code ignored;
    std::string name = (fs::temp_directory_path(ignored) / "carom-listen-XXXXXX").string();
    if (mkdtemp(name.data()) != nullptr) path_ = name;
  }
  ReportFolder(const ReportFolder&) = delete;
  ReportFolder& operator=(const ReportFolder&) = delete;
  ~ReportFolder() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }
  const std::string& path() const { return path_; }  ///< empty if it cannot be made

 private:
  std::string path_;
};

std::string preciseText(double number) {
  std::ostringstream text;
  text << std::setprecision(17) << number;
  return text.str();
}

bool isOurs(std::string_view variable) {
  return variable.starts_with("CAROM_LISTEN_") || variable.starts_with("LD_PRELOAD=");
}

Status checkOutput(const std::string& file) {
  if (!isWavName(file) || !fs::path(file).has_extension())
    return Error{"it is not the name of a WAV file; expected FILE.wav"};
  if (const Status writable = audio::checkWritable(file); !writable) return writable.error();
  const fs::path folder = fs::path(file).has_parent_path() ? fs::path(file).parent_path() : ".";
  if (access(folder.c_str(), W_OK) != 0)
    return Error{"nothing can be written into the folder '" + folder.string() + "'"};
  return std::monostate{};
}

}  // namespace

std::vector<std::string> takeProgram(int& argc, char** argv) {
  if (argc < 2 || std::string_view(argv[1]) != "listen") return {};
  for (int word = 2; word < argc; ++word) {
    if (std::string_view(argv[word]) != "--") continue;
    std::vector<std::string> program(argv + word + 1, argv + argc);
    argc = word;
    return program;
  }
  return {};
}

ListenCommand::ListenCommand(CLI::App& app, std::vector<std::string> program)
    : command_(app.add_subcommand("listen",
                                  "Hear a program that uses Bullet, unchanged\n"
                                  "Brings Carom to a program that links Bullet dynamically, and "
                                  "writes what its worlds sound like (docs/listen.md).")),
      program_(std::move(program)) {
  command_->add_option("-o,--output", output_, "WAV file to write")
      ->required()
      ->type_name("FILE.wav")
      ->check(fileName());
  command_->add_flag("--play", play_, "play it on the default device, too");
  command_
      ->add_option("--full-scale", fullScale_,
                   "what 1.0 in the file stands for; default: chosen at "
                   "the end, for a peak of -3 dB")
      ->check(fullScaleRange());
  command_
      ->add_option("--listener", listener_,
                   "looks along -Z with +Y up, unless turned by a quaternion; default: "
                   "where a camera would stand")
      ->check(poseRange());
  command_
      ->add_option("--units", units_, "metres that the unit of length of the program's worlds is")
      ->check(numberRange(1e-6, 1e6, "metres"))
      ->capture_default_str();
  command_->add_flag("--json", json_, "print one JSON object on stderr instead of text");
  command_->footer(
      "The program stands behind --, with its arguments; its exit code is that of carom.\n"
      "Example:\n"
      "  carom listen -o game.wav -- ./game --level 3");
}

bool ListenCommand::parsed() const {
  return command_->parsed();
}

/// Returns why the program cannot be listened to; empty if it can.
std::string ListenCommand::fault() const {
  if (const Status valid =
          refuseStandardOutput(output_, "--output", "it is the program's; expected FILE.wav");
      !valid)
    return valid.error().message;
  if (program_.empty() || program_.front().empty())
    return "no program; expected it behind --, as in: carom listen -o FILE.wav -- PROGRAM ARGS...";
  if (const Status writable = checkOutput(output_); !writable)
    return output_ + ": " + writable.error().message;
  return {};
}

std::vector<std::string> ListenCommand::variables(const std::string& preloaded,
                                                  const std::string& folder) const {
  std::vector<std::string> all;
  for (char** variable = environ; *variable != nullptr; ++variable)
    if (!isOurs(*variable)) all.emplace_back(*variable);
  const auto add = [&all](const char* name, const std::string& value) {
    all.push_back(std::string(name) + "=" + value);
  };
  const char* const others = std::getenv("LD_PRELOAD");
  const bool hasOthers = others != nullptr && *others != '\0';
  add("LD_PRELOAD", preloaded + (hasOthers ? ":" + std::string(others) : ""));
  std::error_code failed;  // without a working folder, the program finds none either
  const fs::path file = fs::absolute(output_, failed);
  add(listen::kFileVariable, (failed ? fs::path(output_) : file).string());
  add(listen::kFolderVariable, folder);
  if (play_) add(listen::kPlayVariable, "1");
  if (!fullScale_.empty())
    add(listen::kFullScaleVariable, preciseText(fullScalePressure(fullScale_).value_or(1.0)));
  add(listen::kUnitsVariable, preciseText(units_));
  if (const auto pose = listenerPose(listener_)) {
    std::string numbers;
    for (const double number : *pose)
      numbers += (numbers.empty() ? "" : " ") + preciseText(number);
    add(listen::kListenerVariable, numbers);
  }
  return all;
}

int ListenCommand::run() const {
  if (const std::string why = fault(); !why.empty()) return fail(kBadInput, "listen: " + why);
  const std::optional<fs::path> library = preloadedLibrary();
  if (!library)
    return fail(kFailed, std::string("listen: ") + kPreloaded +
                             " is not beside this program; expected a build for Linux with "
                             "CAROM_LISTEN=ON, of its targets carom_listen_preload, "
                             "carom_listen_float and carom_listen_double");
  if (library->string().find_first_of(" :") != std::string::npos)
    return fail(kFailed, "listen: the loader cannot preload '" + library->string() +
                             "'; expected a folder without spaces and colons in its name");
  const ReportFolder folder;
  if (folder.path().empty())
    return fail(kFailed, "listen: no temporary folder can be made; expected one in TMPDIR");
  const Result<int> code = runListened(program_, variables(library->string(), folder.path()));
  if (!code)
    return fail(kBadInput, "listen: '" + program_.front() + "' cannot be started: " +
                               code.error().message + "; expected a program behind --");
  ListenOutcome outcome = readOutcome(folder.path(), output_);
  outcome.exitCode = *code;
  if (talk().isQuiet() && !json_ && !outcome.worlds.empty()) {
    for (const std::string& message : outcome.messages)
      warn(message);
    return *code;
  }
  std::cerr << (json_ ? jsonText(outcomeJson(outcome, program_.front()))
                      : outcomeText(outcome, program_.front()));
  return *code;
}

}  // namespace carom::command
