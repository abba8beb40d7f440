#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "carom/audio/material.h"
#include "carom/audio/result.h"
#include "carom/audio/vector.h"

namespace CLI {
class App;
class Option;
class Validator;
}  // namespace CLI

namespace carom::command {

// Parts that the commands of the program share. Only for main.cpp and the files of commands.

// Exit codes.
inline constexpr int kDone = 0;
inline constexpr int kFailed = 1;
inline constexpr int kBadInput = 2;

/// Prints the message on stderr and returns `code`.
int fail(int code, const std::string& message);
/// Prints the text on stdout, or on stderr if a file goes to stdout; if the program is to be quiet,
/// only JSON. Returns kFailed if it could not be written: a full disk, a closed pipe.
int answer(const std::string& text);

// The headings of options in help. An option without one is below "Options".
inline constexpr const char* kOutput = "Output";
inline constexpr const char* kSound = "Sound";
inline constexpr const char* kMechanics = "Mechanics";
inline constexpr const char* kRunLimits = "Limits";
inline constexpr const char* kMessages = "Messages";

/// Choices of the command line about what is said.
struct TalkFlags {
  bool isQuiet = false;
  bool isVerbose = false;
};

/// Adds -q and -v, which every command has. `flags` must outlive the parsing.
void addTalk(CLI::App& command, TalkFlags& flags);

/// Returns the object as text. Names of files need not be UTF-8: their invalid bytes become U+FFFD.
std::string jsonText(const nlohmann::ordered_json& object);

/// True if the name has the extension .wav or none. Under a name with another extension the file
/// would be WAV all the same.
bool isWavName(const std::string& file);
/// Parses "PA" or "LEVELdB" (above 20 uPa) into Pa; nullopt
/// if the text is neither, or out of range.
std::optional<double> fullScalePressure(const std::string& text);
/// Parses "x,y,z", each within -limit to limit; nullopt if the text is anything else.
std::optional<Vec3> threeNumbers(const std::string& text, double limit);

inline constexpr double kFarthestListener = 1e6;  ///< m, from the origin on each axis

/// Returns the material that an option names: a built-in one, or that of a file with properties, of
/// which the name has an extension. Errors: there is none of the name; those of loadMaterial. The
/// former begin with the option, unless it is empty.
Result<Material> materialOf(const std::string& text, const std::string& option);
/// Accepts the name of a built-in material.
CLI::Validator builtInMaterial();

CLI::Validator oneOf(const std::vector<std::string>& words);
CLI::Validator fileName();
CLI::Validator folderName();
CLI::Validator fullScaleRange();
/// Adds the options --normalize and --full-scale, which set what a sample of 1.0 in a sound file
/// stands for. Returns --normalize. `normalize` and `fullScale` must outlive the parsing.
CLI::Option* addScale(CLI::App& command, bool& normalize, std::string& fullScale);
/// Adds --confine, for commands that read scenes. `confine` must outlive the parsing.
void addConfine(CLI::App& command, bool& confine);
CLI::Validator positionRange();
/// Accepts a number from low to high. (CLI::Range lets NaN pass.)
CLI::Validator numberRange(double low, double high, const std::string& unit);
/// Accepts a whole number from low to high.
CLI::Validator wholeNumberRange(double low, double high, const std::string& unit = "");

}  // namespace carom::command
