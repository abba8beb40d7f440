#include "command/command_line.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <sstream>
#include <string_view>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "carom/audio/synth_settings.h"
#include "modal/json/json_reader.h"
#include "scenes/format/material_reader.h"

namespace carom::command {

namespace {

constexpr double kLeastFullScale = 0.002;    // Pa, 40 dB
constexpr double kMostFullScale = 200000.0;  // Pa, 200 dB

}  // namespace

int fail(int code, const std::string& message) {
  std::cerr << "carom: " << message << '\n';
  return code;
}

int answer(const std::string& text) {
  std::cout << text << std::flush;
  return std::cout ? kDone : fail(kFailed, "standard output cannot be written");
}

std::string jsonText(const nlohmann::ordered_json& object) {
  return object.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

Result<Material> materialOf(const std::string& text) {
  if (const Material* builtIn = findMaterial(text)) return *builtIn;
  if (std::filesystem::path(text).has_extension()) return scenes::loadMaterial(text);
  std::vector<std::string_view> names;
  for (const Material& material : builtInMaterials())
    names.emplace_back(material.name);
  return Error{"--material: unknown material " + modal::inQuotes(text) +
               modal::suggestion(text, names) + "; expected one of " + modal::quotedList(names) +
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
  std::string list = words.front();  // "a, b or c"
  std::string name = words.front();  // "a|b|c"
  for (std::size_t word = 1; word < words.size(); ++word) {
    list += (word + 1 < words.size() ? ", " : " or ") + words[word];
    name += '|' + words[word];
  }
  const auto check = [words, list](const std::string& text) -> std::string {
    if (std::find(words.begin(), words.end(), text) != words.end()) return {};
    return "'" + text + "' is unknown; expected " + list;
  };
  return {check, name};
}

CLI::Validator fileName() {
  return {[](const std::string& text) { return std::string(text.empty() ? "names no file" : ""); },
          "FILE"};
}

CLI::Validator fullScaleRange() {
  const auto check = [](const std::string& text) -> std::string {
    if (fullScalePressure(text)) return {};
    return "'" + text +
           "' is not a full scale; expected a pressure from 0.002 to 200000 (pascals), or a level "
           "from 40dB to 200dB (above 20 uPa)";
  };
  return {check, "PA|LEVELdB"};
}

CLI::Option* addScale(CLI::App& command, bool& normalize, std::string& fullScale) {
  CLI::Option* flag = command.add_flag("--normalize", normalize,
                                       "scale the file so that its loudest sample is 1.0");
  command
      .add_option("--full-scale", fullScale,
                  "what 1.0 in the file is: pascals, or a level such as 120dB; default: 20 (120dB)")
      ->check(fullScaleRange())
      ->excludes(flag);
  return flag;
}

void addConfine(CLI::App& command, bool& confine) {
  command.add_flag("--confine", confine,
                   "refuse files that the scene names outside of its folder, for scenes of "
                   "strangers");
}

CLI::Validator positionRange() {
  const auto check = [](const std::string& text) -> std::string {
    if (threeNumbers(text, kFarthestListener)) return {};
    return "'" + text + "' is no position; expected x,y,z with numbers from -1e6 to 1e6 (metres)";
  };
  return {check, "X,Y,Z"};
}

CLI::Validator numberRange(double low, double high, const std::string& unit) {
  std::ostringstream range;
  range << low << " to " << high << (unit.empty() ? "" : " ") << unit;
  const auto check = [low, high, expected = range.str()](const std::string& text) -> std::string {
    double number = 0.0;
    if (CLI::detail::lexical_cast(text, number) && number >= low && number <= high) return {};
    return "'" + text + "' is not such a number; expected one from " + expected;
  };
  return {check, "NUMBER"};
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
  return {check, "NUMBER"};
}

}  // namespace carom::command
