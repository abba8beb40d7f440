#include "command/help/command_help.h"

#include <algorithm>
#include <cctype>
#include <set>
#include <sstream>

#include <CLI/CLI.hpp>

namespace carom::command {
namespace {

constexpr std::string_view kDefault = "default: ";
constexpr std::size_t kLongestChoice = 24;  // letters of a list of words beside its option

std::vector<std::string> partsOf(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, separator);)
    parts.push_back(part);
  return parts;
}

/// True for the name that the parser gives a type of which nothing else is said.
bool isUnnamed(const std::string& type) {
  static const std::set<std::string> unnamed = {"TEXT", "FLOAT", "INT", "UINT", "BOOLEAN", ""};
  return unnamed.contains(type);
}

/// Returns what an option takes: the name that it was given, or that of its check.
std::string valueOf(const CLI::Option& option) {
  const std::vector<std::string> parts = partsOf(option.get_type_name(), ':');
  for (const std::string& part : parts)
    if (!isUnnamed(part)) return part;
  return parts.empty() ? "TEXT" : parts.front();
}

/// Returns the words that the check of an option has for people.
std::string rangeOf(CLI::Option& option) {
  try {
    return option.get_validator()->get_name();
  } catch (const CLI::OptionNotFound&) {
    return {};
  }
}

bool isChoice(const std::string& part) {
  return !part.empty() && std::ranges::none_of(part, [](unsigned char letter) {
    return std::isupper(letter) != 0 || letter == ',';
  });
}

/// Reads "SCENE|FILE.carom", "native|bullet".
Offer offerOf(const std::string& value) {
  Offer offer;
  for (const std::string& part : partsOf(value, '|')) {
    if (part == "SCENE") offer.scenes = offer.files = true;
    if (part == "MATERIAL") offer.materials = true;
    if (part == "COMMAND") offer.commands = true;
    if (part == "FOLDER") offer.folders = true;
    if (part.starts_with("FILE") || part == "PROGRAM") offer.files = true;
    if (isChoice(part)) offer.words.push_back(part);
  }
  return offer;
}

/// Moves "default: X" from the end of a description to where defaults are.
void takeDefault(OptionHelp& help) {
  const std::size_t at = help.text.rfind(kDefault);
  if (at == std::string::npos) return;
  help.standard = help.text.substr(at + kDefault.size());
  help.text.erase(at);
  while (help.text.ends_with(' ') || help.text.ends_with(';') || help.text.ends_with(','))
    help.text.pop_back();
}

/// Returns the names of the options in an order that does not depend on addresses.
std::vector<std::string> namesOf(const std::set<CLI::Option*>& options) {
  std::vector<std::string> names;
  for (const CLI::Option* option : options)
    names.push_back("--" + option->get_lnames().front());
  std::ranges::sort(names);
  return names;
}

OptionHelp optionHelp(CLI::Option& option) {
  OptionHelp help;
  for (const std::string& name : option.get_snames())
    help.names.push_back("-" + name);
  for (const std::string& name : option.get_lnames())
    help.names.push_back("--" + name);
  const bool isArgument = option.get_positional();
  if (isArgument) help.names = {option.get_name(true)};
  help.text = option.get_description();
  help.standard = option.get_default_str();
  if (help.standard.empty()) takeDefault(help);
  help.group = option.get_group();
  help.isRequired = option.get_required();
  help.isRepeated = option.get_items_expected_max() > 1;
  help.excludes = namesOf(option.get_excludes());
  help.needs = namesOf(option.get_needs());
  if (!isArgument && option.get_items_expected_max() == 0) return help;
  const std::string value = valueOf(option);
  help.value = isUnnamed(value) && isArgument ? help.names.front() : value;
  help.range = rangeOf(option);
  help.offer = offerOf(help.value);
  if (help.offer.words.size() < 2 || help.value.size() <= kLongestChoice) return help;
  help.value = "NAME";
  help.range = "one of " + wordList(help.offer.words);
  return help;
}

/// Sorts the lines of a footer into examples and the rest.
void readFooter(const std::string& footer, CommandHelp& help) {
  bool isExample = false;
  for (const std::string& line : partsOf(footer, '\n')) {
    if (line == "Example:" || line == "Examples:") {
      isExample = true;
    } else if (isExample && line.starts_with("  ")) {
      help.examples.push_back(line.substr(2));
    } else {
      isExample = false;
      help.notes += line + '\n';
    }
  }
}

CommandHelp commandHelp(CLI::App& app, const std::string& before) {
  CommandHelp help;
  const bool isProgram = app.get_parent() == nullptr;
  if (!isProgram) help.name = before.empty() ? app.get_name() : before + ' ' + app.get_name();
  const std::string description = app.get_description();
  const std::size_t end = std::min(description.find('\n'), description.size());
  help.summary = description.substr(0, end);
  if (end < description.size()) help.purpose = description.substr(end + 1);
  help.group = app.get_group();
  const auto isShown = [](const CLI::Option* option) { return !option->get_group().empty(); };
  for (CLI::Option* option : app.get_options(isShown))
    (option->get_positional() ? help.arguments : help.options).push_back(optionHelp(*option));
  readFooter(app.get_footer(), help);
  for (CLI::App* command : app.get_subcommands([](CLI::App*) { return true; }))
    if (!command->get_group().empty()) help.commands.push_back(commandHelp(*command, help.name));
  return help;
}

}  // namespace

std::vector<std::string> CommandHelp::groups() const {
  std::vector<std::string> found;
  for (const OptionHelp& option : options)
    if (std::ranges::find(found, option.group) == found.end()) found.push_back(option.group);
  const auto rank = [](const std::string& heading) {
    return heading == "Limits" ? 1 : heading == "Messages" ? 2 : 0;
  };
  std::ranges::stable_sort(found, {}, rank);
  return found;
}

std::string CommandHelp::usage() const {
  std::string text = "carom";
  if (!name.empty()) text += ' ' + name;
  if (!commands.empty()) text += " COMMAND";
  if (!options.empty()) text += " [OPTIONS]";
  for (const OptionHelp& option : options)
    if (option.isRequired) text += ' ' + option.names.front() + ' ' + option.value;
  for (const OptionHelp& argument : arguments) {
    const std::string word = argument.names.front() + (argument.isRepeated ? "..." : "");
    text += ' ' + (argument.isRequired ? word : '[' + word + ']');
  }
  return text;
}

CommandHelp helpOf(CLI::App& app) {
  return commandHelp(app, "");
}

const CommandHelp* findCommand(const CommandHelp& all, const std::vector<std::string>& words) {
  const CommandHelp* found = &all;
  for (const std::string& word : words) {
    const std::string name = found->name.empty() ? word : found->name + ' ' + word;
    const auto next = std::ranges::find(found->commands, name, &CommandHelp::name);
    if (next == found->commands.end()) return nullptr;
    found = &*next;
  }
  return found;
}

std::string wordList(const std::vector<std::string>& words) {
  std::string list;
  for (std::size_t word = 0; word < words.size(); ++word) {
    if (word > 0) list += word + 1 < words.size() ? ", " : " or ";
    list += words[word];
  }
  return list;
}

}  // namespace carom::command
