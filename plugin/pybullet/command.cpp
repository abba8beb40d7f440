#include "plugin/pybullet/command.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <system_error>
#include <vector>

#include "audio/model/decimal.h"
#include "carom/audio/material.h"

namespace carom::plugin {
namespace {

constexpr std::string_view kBlank = " \t\r\n";
constexpr double kLargestGain = 1000.0;
constexpr double kLengthTolerance = 1e-3;  // for a quaternion, as its text is rounded

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

std::vector<std::string_view> words(std::string_view text) {
  std::vector<std::string_view> found;
  for (text = trimmed(text); !text.empty(); text = trimmed(text)) {
    const std::size_t length = std::min(text.find_first_of(kBlank), text.size());
    found.push_back(text.substr(0, length));
    text.remove_prefix(length);
  }
  return found;
}

std::string inQuotes(std::string_view text) {
  std::string quoted(1, '\'');  // GCC 12 warns of "'" + string, wrongly (its bug 105651)
  quoted.append(text).append(1, '\'');
  return quoted;
}

std::from_chars_result read(const char* first, const char* last, int& value) {
  return std::from_chars(first, last, value);
}
std::from_chars_result read(const char* first, const char* last, double& value) {
  return audio::readDecimal(first, last, value);
}

template <class Number>
std::optional<Number> number(std::string_view text) {
  Number value{};
  const auto [end, error] = read(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

Result<double> finite(std::string_view text) {
  const std::optional<double> value = number<double>(text);
  if (value && std::isfinite(*value)) return *value;
  return Error{inQuotes(text) + " is not a finite number"};
}

using Words = std::vector<std::string_view>;

Result<Command> listener(const Words& arguments) {
  if (arguments.size() != 3 && arguments.size() != 7) {
    return Error{"listener takes X Y Z (m), or X Y Z QX QY QZ QW, not " +
                 std::to_string(arguments.size()) + " numbers"};
  }
  std::vector<double> values;
  for (const std::string_view argument : arguments) {
    const Result<double> value = finite(argument);
    if (!value) return Error{"listener: " + value.error().message};
    values.push_back(*value);
  }
  command::PlaceListener place{{values[0], values[1], values[2]}, uprightOrientation()};
  if (values.size() == 7) {
    const Quat turned(values[6], values[3], values[4], values[5]);
    if (std::abs(turned.norm() - 1.0) > kLengthTolerance) {
      return Error{"listener: the quaternion QX QY QZ QW has length " +
                   std::to_string(turned.norm()) + "; expected 1"};
    }
    place.orientation = turned.normalized();
  }
  return Command(place);
}

Result<Command> material(const Words& arguments) {
  if (arguments.size() != 2 && arguments.size() != 3)
    return Error{"material takes BODY NAME or BODY LINK NAME, such as: material 3 steel"};
  const std::optional<int> body = number<int>(arguments.front());
  if (!body || *body < 0)
    return Error{"material: body " + inQuotes(arguments.front()) + " is not a number from 0"};
  command::SetMaterial set{.body = *body, .name = std::string(arguments.back())};
  if (arguments.size() == 3) {
    set.link = number<int>(arguments[1]);
    if (!set.link || *set.link < -1)
      return Error{"material: link " + inQuotes(arguments[1]) +
                   " is not a number from -1, the base"};
  }
  if (findMaterial(set.name) != nullptr) return Command(set);
  std::string known;
  for (const Material& each : builtInMaterials())
    known += (known.empty() ? "" : ", ") + each.name;
  return Error{"material: there is no " + inQuotes(set.name) + "; expected one of " + known};
}

Result<Command> gain(const Words& arguments) {
  const auto value = arguments.size() == 1 ? number<double>(arguments.front()) : std::nullopt;
  if (!value || !(*value >= 0.0 && *value <= kLargestGain))
    return Error{"gain takes one number from 0 to 1000"};
  return Command(command::SetGain{*value});
}

Result<Command> mute(const Words& arguments) {
  const bool isOne = arguments.size() == 1;
  if (isOne && arguments.front() == "on") return Command(command::Mute{true});
  if (isOne && arguments.front() == "off") return Command(command::Mute{false});
  return Error{"mute takes on or off"};
}

Result<Command> record(std::string_view file) {
  if (file.empty()) return Error{"record takes the name of a file, such as: record out.wav"};
  return Command(command::Record{file});
}

Result<Command> bare(std::string_view name, const Words& arguments) {
  const bool isCommand =
      name == "play" || name == "stop" || name == "pause" || name == "stats" || name == "help";
  if (!isCommand) {
    return Error{"there is no command " + inQuotes(name) +
                 "; expected listener, material, record, play, stop, gain, mute, pause, stats or "
                 "help"};
  }
  if (!arguments.empty())
    return Error{std::string(name) + " takes nothing, not " + inQuotes(arguments.front())};
  if (name == "play") return Command(command::Play{});
  if (name == "stop") return Command(command::Stop{});
  if (name == "pause") return Command(command::Pause{});
  if (name == "stats") return Command(command::Stats{});
  return Command(command::Help{});
}

}  // namespace

Quat uprightOrientation() {
  return Quat(Eigen::AngleAxisd(0.5 * std::numbers::pi, Vec3::UnitX()));
}

Result<Command> parseCommand(std::string_view text) {
  text = trimmed(text);
  Words arguments = words(text);
  if (arguments.empty()) return Error{"the command is empty; 'help' lists them"};
  const std::string_view name = arguments.front();
  arguments.erase(arguments.begin());
  if (name == "listener") return listener(arguments);
  if (name == "material") return material(arguments);
  if (name == "gain") return gain(arguments);
  if (name == "mute") return mute(arguments);
  // The rest of the text is the file's name, which may hold blanks.
  if (name == "record") return record(trimmed(text.substr(name.size())));
  return bare(name, arguments);
}

}  // namespace carom::plugin
