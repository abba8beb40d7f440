#include "command/command_line.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <sstream>
#include <string_view>

#include "command/help/command_help.h"
#include "command/signals.h"
#include "command/terminal/terminal.h"
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "carom/audio/synth_settings.h"
#include "modal/json/json_reader.h"
#include "scenes/format/material_reader.h"

namespace carom::command {

namespace {

constexpr double kLeastFullScale = 0.002;    // Pa, 40 dB
constexpr double kMostFullScale = 200000.0;  // Pa, 200 dB

/// Returns the word that stands for a number of that unit in a command line.
std::string valueWord(const std::string& unit) {
  std::string word;
  for (const char letter : unit)
    word += static_cast<char>(std::toupper(static_cast<unsigned char>(letter)));
  const bool isWord =
      std::ranges::all_of(unit, [](unsigned char letter) { return std::isalpha(letter) != 0; });
  return isWord && !word.empty() ? word : "NUMBER";
}

/// Returns the number as people write it: 1e9 for 1e+09.
std::string briefNumber(double number) {
  std::ostringstream text;
  text << number;
  std::string digits = text.str();
  const std::size_t exponent = digits.find('e');
  if (exponent == std::string::npos) return digits;
  std::string power = digits.substr(exponent + 1);
  const bool isNegative = power.starts_with('-');
  power.erase(0, power.find_first_not_of("+-0"));
  return digits.substr(0, exponent) + (isNegative ? "e-" : "e") + power;
}

std::string rangeWords(const std::string& noun, double low, double high, const std::string& unit) {
  return noun +
         (unit.empty()   ? ""
          : unit == "Hz" ? " in Hz"
                         : " of " + unit) +
         " from " + briefNumber(low) + " to " + briefNumber(high);
}

/// Returns what is wrong with a name of a material that is none.
std::string unknownMaterial(const std::string& name) {
  std::vector<std::string_view> names;
  for (const Material& material : builtInMaterials())
    names.emplace_back(material.name);
  return "unknown material " + modal::inQuotes(name) + modal::suggestion(name, names) +
         "; expected a name that 'carom materials' lists";
}

}  // namespace

int fail(int code, const std::string& message) {
  std::cerr << styled("carom:", Style::error, Stream::err) << ' ' << modal::withoutControls(message)
            << '\n';
  return code;
}

int answer(const std::string& text) {
  if (talk().isQuiet() && !talk().isJson) return kDone;
  if (talk().isOutputTaken) {
    std::cerr << text << std::flush;
    return kDone;
  }
  errno = 0;
  std::cout << text << std::flush;
  if (!std::cout && errno == EPIPE) endAsWithoutReader();
  return std::cout ? kDone : fail(kFailed, "standard output cannot be written");
}

void addTalk(CLI::App& command, TalkFlags& flags) {
  command.get_help_ptr()->group(kMessages);
  if (CLI::Option* const json = command.get_option_no_throw("--json")) json->group(kMessages);
  command.option_defaults()->group(kMessages);
  CLI::Option* const quiet =
      command.add_flag("-q,--quiet", flags.isQuiet, "say nothing but errors and warnings");
  command
      .add_flag("-v,--verbose", flags.isVerbose, "say all that there is to say, where it is more")
      ->excludes(quiet);
}

std::string jsonText(const nlohmann::ordered_json& object) {
  return object.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

Result<Material> materialOf(const std::string& text, const std::string& option) {
  if (const Material* builtIn = findMaterial(text)) return *builtIn;
  if (std::filesystem::path(text).has_extension()) return scenes::loadMaterial(text);
  return Error{option + (option.empty() ? "" : ": ") + unknownMaterial(text) +
               ", or a file FILE.json with its properties"};
}

bool isWavName(const std::string& file) {
  std::string extension = std::filesystem::path(file).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension.empty() || extension == ".wav";
}

std::optional<double> fullScalePressure(const std::string& text) {
  const bool level = text.size() > 2 && CLI::detail::to_lower(text.substr(text.size() - 2)) == "db";
  double number = 0.0;
  if (!CLI::detail::lexical_cast(level ? text.substr(0, text.size() - 2) : text, number)) return {};
  const double pressure = level ? kHearingThreshold * std::pow(10.0, number / 20.0) : number;
  // The limits are widened by half a step of rounding, so that they can be given in either unit.
  if (!(pressure >= kLeastFullScale * (1.0 - 1e-12) && pressure <= kMostFullScale * (1.0 + 1e-12)))
    return {};
  return pressure;
}

std::optional<Vec3> threeNumbers(const std::string& text, double limit) {
  Vec3 found = Vec3::Zero();
  std::istringstream parts(text);
  std::string part;
  for (double& component : found) {
    if (!std::getline(parts, part, ',') || !CLI::detail::lexical_cast(part, component)) return {};
    if (!(std::abs(component) <= limit)) return {};
  }
  if (std::getline(parts, part) || text.ends_with(',')) return {};
  return found;
}

CLI::Validator oneOf(const std::vector<std::string>& words) {
  std::string name = words.front();  // "a|b|c"
  for (std::size_t word = 1; word < words.size(); ++word)
    name += '|' + words[word];
  const auto check = [words](const std::string& text) -> std::string {
    if (std::find(words.begin(), words.end(), text) != words.end()) return {};
    const std::vector<std::string_view> views(words.begin(), words.end());
    return "'" + text + "' is unknown" + modal::suggestion(text, views) + "; expected " +
           wordList(words);
  };
  return {check, name};
}

CLI::Validator builtInMaterial() {
  return {[](const std::string& text) {
            return findMaterial(text) != nullptr ? std::string() : unknownMaterial(text);
          },
          "MATERIAL", "a name that 'carom materials' lists"};
}

CLI::Validator fileName() {
  return {[](const std::string& text) { return std::string(text.empty() ? "names no file" : ""); },
          "FILE"};
}

CLI::Validator folderName() {
  return {
      [](const std::string& text) { return std::string(text.empty() ? "names no folder" : ""); },
      "FOLDER"};
}

CLI::Validator fullScaleRange() {
  const auto check = [](const std::string& text) -> std::string {
    if (fullScalePressure(text)) return {};
    return "'" + text +
           "' is not a full scale; expected a pressure from 0.002 to 200000 (pascals), or a level "
           "from 40dB to 200dB (above 20 uPa)";
  };
  return {check, "LEVEL", "a pressure in Pa, or a level such as 120dB, from 40dB to 200dB"};
}

CLI::Option* addScale(CLI::App& command, bool& normalize, std::string& fullScale) {
  CLI::Option* flag =
      command
          .add_flag("--normalize", normalize, "scale the file so that its loudest sample is 1.0")
          ->group(kOutput);
  command
      .add_option("--full-scale", fullScale,
                  "what 1.0 in the file stands for; default: 20 Pa, which is 120dB")
      ->group(kOutput)
      ->check(fullScaleRange())
      ->excludes(flag);
  return flag;
}

void addConfine(CLI::App& command, bool& confine) {
  command
      .add_flag("--confine", confine,
                "refuse files that the scene names outside of its folder, for scenes of strangers")
      ->group(kRunLimits);
}

CLI::Validator positionRange() {
  const auto check = [](const std::string& text) -> std::string {
    if (threeNumbers(text, kFarthestListener)) return {};
    return "'" + text + "' is no position; expected x,y,z with numbers from -1e6 to 1e6 (metres)";
  };
  return {check, "X,Y,Z", "three numbers of metres"};
}

CLI::Validator numberRange(double low, double high, const std::string& unit) {
  std::ostringstream range;
  range << low << " to " << high << (unit.empty() ? "" : " ") << unit;
  const auto check = [low, high, expected = range.str()](const std::string& text) -> std::string {
    double number = 0.0;
    if (CLI::detail::lexical_cast(text, number) && number >= low && number <= high) return {};
    return "'" + text + "' is not such a number; expected one from " + expected;
  };
  return {check, valueWord(unit), rangeWords("a number", low, high, unit)};
}

CLI::Validator wholeNumberRange(double low, double high, const std::string& unit) {
  std::ostringstream range;
  range << std::fixed << std::setprecision(0) << low << " to " << high << (unit.empty() ? "" : " ")
        << unit;
  const auto check = [low, high, expected = range.str()](const std::string& text) -> std::string {
    double number = 0.0;
    const bool read = CLI::detail::lexical_cast(text, number);
    if (read && number >= low && number <= high && number == std::floor(number)) return {};
    return "'" + text + "' is not such a number; expected a whole one from " + expected;
  };
  return {check, valueWord(unit), rangeWords("a whole number", low, high, unit)};
}

}  // namespace carom::command
