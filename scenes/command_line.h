#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "carom/audio/vector.h"

namespace CLI {
class App;
class Option;
class Validator;
}  // namespace CLI

namespace carom::scenes {

// What the commands of the program have in common. Only for main.cpp and the files of commands.

// Exit codes.
inline constexpr int kDone = 0;
inline constexpr int kFailed = 1;
inline constexpr int kBadInput = 2;

/// Says on stderr why not, and returns `code`.
int fail(int code, const std::string& message);
/// Prints; an answer that did not get out is a failure: a full disk, a closed pipe.
int answer(const std::string& text);
/// Names of files need not be UTF-8; in JSON their odd bytes become U+FFFD.
std::string jsonText(const nlohmann::ordered_json& object);

/// A name that promises another format would hold WAV all the same.
bool isWavName(const std::string& file);
/// Pa of "PA" or of "LEVELdB" above 20 uPa; nullopt where it is neither, or out of range.
std::optional<double> fullScalePressure(const std::string& text);
/// "x,y,z", each within -limit to limit; nullopt where it is none.
std::optional<Vec3> threeNumbers(const std::string& text, double limit);

inline constexpr double kFarthestListener = 1e6;  ///< m, from the origin on each axis

CLI::Validator oneOf(const std::vector<std::string>& words);
CLI::Validator fileName();
CLI::Validator fullScaleRange();
/// --normalize, which is returned, and --full-scale: what 1.0 in a sound file is. Both outlive the
/// parsing.
CLI::Option* addScale(CLI::App& command, bool& normalize, std::string& fullScale);
CLI::Validator positionRange();
/// A number from low to high. (CLI::Range lets NaN pass.)
CLI::Validator numberRange(double low, double high, const std::string& unit);
/// The same without a fraction, of things that are counted.
CLI::Validator wholeNumberRange(double low, double high);

}  // namespace carom::scenes
