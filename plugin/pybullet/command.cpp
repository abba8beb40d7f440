#include "plugin/pybullet/command.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <numbers>
#include <span>
#include <sstream>
#include <system_error>
#include <utility>
#include <vector>

#include "audio/model/decimal.h"
#include "carom/audio/material.h"

namespace carom::plugin {
namespace {

constexpr std::string_view kBlank = " \t\r\n";
constexpr double kLargestGain = 1000.0;
constexpr double kLongestClock = 1e9;      // s
constexpr double kLongestKept = 86400.0;   // s
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

/// The words of a command, those of the form NAME=VALUE apart. FILE is all that is left.
class Arguments {
 public:
  /// Splits `text`; a value of the name `last` reaches to the end of it, blanks included.
  explicit Arguments(std::string_view text, std::string_view last = {}) {
    while (!(text = trimmed(text)).empty()) {
      const std::size_t end = std::min(text.find_first_of(kBlank), text.size());
      const std::size_t sign = text.substr(0, end).find('=');
      if (sign == std::string_view::npos) {
        plain_.push_back(text.substr(0, end));
        text.remove_prefix(end);
        continue;
      }
      const std::string_view name = text.substr(0, sign);
      const bool isLast = !last.empty() && name == last;
      const std::string_view value =
          isLast ? trimmed(text.substr(sign + 1)) : text.substr(sign + 1, end - sign - 1);
      named_.emplace_back(name, value);
      text.remove_prefix(isLast ? text.size() : end);
    }
  }

  const Words& plain() const { return plain_; }
  /// Takes the value of a name away; nothing if it is not there.
  std::optional<std::string_view> take(std::string_view name) {
    const auto found = std::ranges::find(named_, name, &Named::first);
    if (found == named_.end()) return std::nullopt;
    const std::string_view value = found->second;
    named_.erase(found);
    return value;
  }
  /// Refuses names that nobody has taken; `expected` lists those there are.
  Status spent(std::string_view command, std::string_view expected) const {
    if (named_.empty()) return std::monostate{};
    return Error{std::string(command) + " has no " + inQuotes(named_.front().first) +
                 "; expected " + std::string(expected)};
  }

 private:
  using Named = std::pair<std::string_view, std::string_view>;
  Words plain_;
  std::vector<Named> named_;
};

/// Refuses a value of a name.
Error wrong(std::string_view command, std::string_view name, std::string_view value,
            std::string_view expected) {
  return Error{std::string(command) + ": " + std::string(name) + "=" + std::string(value) +
               "; expected " + std::string(expected)};
}

/// Reads a number within bounds, if the name is there.
Status readNumber(Arguments& arguments, std::string_view command, std::string_view name,
                  double least, double most, std::optional<double>& value) {
  const auto text = arguments.take(name);
  if (!text) return std::monostate{};
  value = number<double>(*text);
  if (value && *value >= least && *value <= most) return std::monostate{};
  std::ostringstream expected;
  expected << least << " to " << most;
  return wrong(command, name, *text, expected.str());
}

Result<std::vector<double>> numbers(std::string_view command,
                                    std::span<const std::string_view> from) {
  std::vector<double> values;
  for (const std::string_view argument : from) {
    const Result<double> value = finite(argument);
    if (!value) return Error{std::string(command) + ": " + value.error().message};
    values.push_back(*value);
  }
  return values;
}

Result<ListenerFormat> listenerFormat(std::string_view name) {
  if (name == "mono") return ListenerFormat::mono;
  if (name == "spaced_pair") return ListenerFormat::spacedPair;
  if (name == "coincident_pair") return ListenerFormat::coincidentPair;
  if (name == "binaural") return ListenerFormat::binaural;
  return wrong("listener", "format", name, "mono, spaced_pair, coincident_pair or binaural");
}

/// Reads what makes a listener another receiver.
Status readReceiver(Arguments& arguments, command::PlaceListener& place) {
  constexpr double kMostIndex = 63.0;
  constexpr double kHalfTurn = std::numbers::pi;
  std::optional<double> index;
  if (Status read = readNumber(arguments, "listener", "index", 0.0, kMostIndex, index); !read)
    return read;
  if (index && *index != std::floor(*index))
    return Error{"listener: the index is not a whole number"};
  place.index = static_cast<std::size_t>(index.value_or(0.0));
  if (const auto name = arguments.take("format")) {
    const Result<ListenerFormat> format = listenerFormat(*name);
    if (!format) return format.error();
    place.format = *format;
  }
  if (const auto file = arguments.take("head")) {
    if (file->empty()) return Error{"listener: head= takes the name of a SOFA file"};
    place.head = std::filesystem::path(*file);
    if (place.format.value_or(ListenerFormat::binaural) != ListenerFormat::binaural)
      return Error{"listener: only a binaural one has a head"};
    place.format = ListenerFormat::binaural;
  }
  for (const Status& read :
       {readNumber(arguments, "listener", "spacing", 0.0, 100.0, place.spacing),
        readNumber(arguments, "listener", "angle", 0.0, kHalfTurn, place.halfAngle),
        readNumber(arguments, "listener", "pattern", 0.0, 1.0, place.pattern)})
    if (!read) return read;
  return arguments.spent("listener", "index, format, spacing, angle, pattern or head");
}

Result<Command> listener(std::string_view text) {
  Arguments arguments(text, "head");
  const Words& plain = arguments.plain();
  if (plain.size() != 3 && plain.size() != 7) {
    return Error{"listener takes X Y Z (m), or X Y Z QX QY QZ QW, not " +
                 std::to_string(plain.size()) + " numbers"};
  }
  const Result<std::vector<double>> values = numbers("listener", plain);
  if (!values) return values.error();
  const std::vector<double>& at = *values;
  command::PlaceListener place;
  place.position = {at[0], at[1], at[2]};
  place.orientation = uprightOrientation();
  if (at.size() == 7) {
    const Quat turned(at[6], at[3], at[4], at[5]);
    if (!(std::abs(turned.norm() - 1.0) <= kLengthTolerance)) {
      return Error{"listener: the quaternion QX QY QZ QW has length " +
                   std::to_string(turned.norm()) + "; expected 1"};
    }
    place.orientation = turned.normalized();
  }
  if (const Status read = readReceiver(arguments, place); !read) return read.error();
  return Command(std::move(place));
}

Result<int> bodyNumber(std::string_view command, std::string_view text) {
  const std::optional<int> body = number<int>(text);
  if (body && *body >= 0) return *body;
  return Error{std::string(command) + ": body " + inQuotes(text) + " is not a number from 0"};
}

Result<int> linkNumber(std::string_view command, std::string_view text) {
  const std::optional<int> link = number<int>(text);
  if (link && *link >= -1) return *link;
  return Error{std::string(command) + ": link " + inQuotes(text) +
               " is not a number from -1, the base"};
}

Result<Command> material(const Words& arguments) {
  if (arguments.size() != 2 && arguments.size() != 3)
    return Error{"material takes BODY NAME or BODY LINK NAME, such as: material 3 steel"};
  const Result<int> body = bodyNumber("material", arguments.front());
  if (!body) return body.error();
  command::SetMaterial set{.target = {.body = *body}, .name = std::string(arguments.back())};
  if (arguments.size() == 3) {
    const Result<int> link = linkNumber("material", arguments[1]);
    if (!link) return link.error();
    set.target.link = *link;
  }
  if (findMaterial(set.name) != nullptr) return Command(set);
  std::string known;
  for (const Material& each : builtInMaterials())
    known += (known.empty() ? "" : ", ") + each.name;
  return Error{"material: there is no " + inQuotes(set.name) + "; expected one of " + known};
}

/// Takes a word from the front of a text.
std::string_view takeWord(std::string_view& text) {
  text = trimmed(text);
  const std::string_view word = text.substr(0, std::min(text.find_first_of(kBlank), text.size()));
  text = trimmed(text.substr(word.size()));
  return word;
}

/// Takes BODY [link=N] from the front of a text.
Result<command::Target> takeTarget(std::string_view command, std::string_view& text) {
  constexpr std::string_view kLink = "link=";
  const Result<int> body = bodyNumber(command, takeWord(text));
  if (!body) return body.error();
  command::Target target{.body = *body};
  if (!text.starts_with(kLink)) return target;
  const Result<int> link = linkNumber(command, takeWord(text).substr(kLink.size()));
  if (!link) return link.error();
  target.link = *link;
  return target;
}

Result<Command> modes(std::string_view text) {
  const Result<command::Target> target = takeTarget("modes", text);
  if (!target) return target.error();
  if (text.empty()) return Error{"modes takes BODY FILE or BODY link=N FILE; FILE may be none"};
  if (text == "none") return Command(command::SetModes{*target});
  return Command(command::SetModes{*target, std::filesystem::path(text)});
}

Result<Command> texture(std::string_view text) {
  const Result<command::Target> target = takeTarget("texture", text);
  if (!target) return target.error();
  if (text == "none") return Command(command::SetTexture{.target = *target});
  const std::array<std::string_view, 2> sides = {takeWord(text), takeWord(text)};
  if (text.empty())
    return Error{"texture takes BODY [link=N] WIDTH HEIGHT FILE (m), or BODY [link=N] none"};
  const Result<std::vector<double>> size = numbers("texture", sides);
  if (!size) return size.error();
  if (!((*size)[0] > 0.0 && (*size)[1] > 0.0))
    return Error{"texture: WIDTH and HEIGHT of the picture must be above 0 (m)"};
  return Command(command::SetTexture{
      .target = *target, .size = {(*size)[0], (*size)[1]}, .file = std::filesystem::path(text)});
}

Result<Absorption> surface(std::string_view text) {
  Absorption absorption;
  if (const Surface* const known = findSurface(text)) return known->absorption;
  const std::optional<double> share = number<double>(text);
  if (share && *share >= 0.0 && *share <= 1.0) {
    absorption.coefficients.fill(*share);
    return absorption;
  }
  std::string expected = "0 to 1";
  for (const Surface& each : surfaceTable())
    expected.append(", ").append(each.name);
  return wrong("room", "surface", text, expected);
}

Result<Command> room(std::string_view text) {
  if (trimmed(text) == "none") return Command(command::SetRoom{});
  Arguments arguments(text);
  if (arguments.plain().size() != 6)
    return Error{"room takes the corners X0 Y0 Z0 X1 Y1 Z1 of a box (m), or none"};
  const Result<std::vector<double>> at = numbers("room", arguments.plain());
  if (!at) return at.error();
  command::SetRoom set{.isBox = true,
                       .least = {(*at)[0], (*at)[1], (*at)[2]},
                       .most = {(*at)[3], (*at)[4], (*at)[5]}};
  if (!(set.least.array() < set.most.array()).all())
    return Error{"room: each of X0 Y0 Z0 must be below that of X1 Y1 Z1"};
  const Result<Absorption> walls = surface(arguments.take("surface").value_or("plaster"));
  if (!walls) return walls.error();
  set.absorption = *walls;
  std::optional<double> order;
  constexpr double kMostOrder = 32.0;
  if (const Status read = readNumber(arguments, "room", "order", 0.0, kMostOrder, order); !read)
    return read.error();
  set.order = static_cast<int>(order.value_or(1.0));
  const std::string_view reverb = arguments.take("reverb").value_or("on");
  if (reverb != "on" && reverb != "off") return wrong("room", "reverb", reverb, "on or off");
  set.hasReverb = reverb == "on";
  if (const Status spent = arguments.spent("room", "surface, order or reverb"); !spent)
    return spent.error();
  return Command(set);
}

Result<Command> level(const Words& arguments) {
  if (arguments.size() == 1 && arguments.front() == "automatic")
    return Command(command::SetLevel{});
  const auto value = arguments.size() == 1 ? number<double>(arguments.front()) : std::nullopt;
  if (!value || !(*value > 0.0) || !std::isfinite(*value))
    return Error{"level takes automatic, or the pressure (Pa) of a sample of 1.0, above 0"};
  return Command(command::SetLevel{*value});
}

Result<Command> latency(const Words& arguments) {
  const auto value = arguments.size() == 1 ? number<double>(arguments.front()) : std::nullopt;
  if (!value || !(*value >= 0.0 && *value <= 10.0))
    return Error{"latency takes one number from 0 to 10 (s)"};
  return Command(command::SetLatency{*value});
}

Result<Command> reset(const Words& arguments) {
  if (arguments.empty()) return Command(command::Reset{});
  const auto value = arguments.size() == 1 ? number<double>(arguments.front()) : std::nullopt;
  if (!value || !(*value >= 0.0 && *value <= kLongestClock))
    return Error{"reset takes nothing, or the time of the clock from 0 to 1e9 (s)"};
  return Command(command::Reset{*value});
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

template <class Kind>
Result<Command> runFile(std::string_view name, std::string_view file) {
  if (file.empty())
    return Error{std::string(name) + " takes the name of a file, such as: " + std::string(name) +
                 " out.carom"};
  return Command(Kind{file});
}

Result<Command> keepRun(const Words& arguments) {
  const auto value = arguments.size() == 1 ? number<double>(arguments.front()) : std::nullopt;
  if (!value || !(*value >= 0.0 && *value <= kLongestKept))
    return Error{"keep-run takes one number from 0 to 86400 (s)"};
  return Command(command::KeepRun{*value});
}

Result<Command> bare(std::string_view name, const Words& arguments) {
  static const std::map<std::string_view, Command> kBare = {
      {"play", command::Play{}},         {"stop", command::Stop{}},
      {"pause", command::Pause{}},       {"capture", command::Capture{}},
      {"stats", command::Stats{}},       {"report", command::Report{}},
      {"describe", command::Describe{}}, {"samples", command::TakeSamples{}},
      {"events", command::TakeEvents{}}, {"help", command::Help{}}};
  const auto found = kBare.find(name);
  if (found == kBare.end()) {
    return Error{"there is no command " + inQuotes(name) +
                 "; expected listener, material, modes, texture, room, level, latency, record, "
                 "record-run, keep-run, save-run, play, stop, gain, mute, pause, capture, reset, "
                 "samples, events, describe, stats, report "
                 "or help"};
  }
  if (!arguments.empty())
    return Error{std::string(name) + " takes nothing, not " + inQuotes(arguments.front())};
  return found->second;
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
  const std::string_view rest = trimmed(text.substr(name.size()));  // files may have blanks
  if (name == "listener") return listener(rest);
  if (name == "material") return material(arguments);
  if (name == "modes") return modes(rest);
  if (name == "texture") return texture(rest);
  if (name == "room") return room(rest);
  if (name == "level") return level(arguments);
  if (name == "latency") return latency(arguments);
  if (name == "gain") return gain(arguments);
  if (name == "mute") return mute(arguments);
  if (name == "reset") return reset(arguments);
  if (name == "record") return record(rest);
  if (name == "record-run") return runFile<command::RecordRun>(name, rest);
  if (name == "save-run") return runFile<command::SaveRun>(name, rest);
  if (name == "keep-run") return keepRun(arguments);
  return bare(name, arguments);
}

}  // namespace carom::plugin
