#include "command/help/manual_page.h"

#include <array>
#include <cctype>
#include <cstdlib>
#include <ctime>
#include <sstream>
#include <string_view>

#include "command/help/help_text.h"

namespace carom::command {
namespace {

/// Returns text for man(7): nothing in it is taken for a request, and quotation marks and hyphens
/// stay what they are when they are copied.
std::string escaped(std::string_view text) {
  std::string safe;
  for (const char letter : text) {
    switch (letter) {
      case '\\':
        safe += "\\e";
        break;
      case '\'':
        safe += "\\(aq";
        break;
      case '`':
        safe += "\\(ga";
        break;
      case '^':
        safe += "\\(ha";
        break;
      case '~':
        safe += "\\(ti";
        break;
      case '-':
        safe += "\\-";
        break;
      default:
        safe += letter;
    }
  }
  return safe.starts_with('.') ? "\\&" + safe : safe;
}

std::string bold(std::string_view text) {
  return "\\fB" + escaped(text) + "\\fR";
}

std::string italic(std::string_view text) {
  return "\\fI" + escaped(text) + "\\fR";
}

std::string upperCase(std::string text) {
  for (char& letter : text)
    letter = static_cast<char>(std::toupper(static_cast<unsigned char>(letter)));
  return text;
}

/// Returns "carom-batch-run" for "batch run".
std::string pageName(const CommandHelp& command) {
  std::string name = "carom";
  if (!command.name.empty()) name += '-' + command.name;
  return name;
}

/// Returns the day of SOURCE_DATE_EPOCH, by which packages are built the same again; empty without.
std::string dateText() {
  const char* const epoch = std::getenv("SOURCE_DATE_EPOCH");  // NOLINT(concurrency-mt-unsafe)
  if (epoch == nullptr) return {};
  char* end = nullptr;
  const std::time_t seconds = std::strtoll(epoch, &end, 10);
  std::tm day{};
  std::array<char, 16> text{};
  if (*end != '\0' || gmtime_r(&seconds, &day) == nullptr) return {};
  std::strftime(text.data(), text.size(), "%Y-%m-%d", &day);
  return text.data();
}

std::string section(const std::string& title) {
  return ".SH " + upperCase(escaped(title)) + '\n';
}

std::string entry(const std::string& term, const std::string& text) {
  return ".TP\n" + term + '\n' + escaped(text) + '\n';
}

std::string termOf(const OptionHelp& option) {
  std::string term;
  for (const std::string& name : option.names)
    term += (term.empty() ? "" : ", ") + bold(name);
  return option.value.empty() ? term : term + ' ' + italic(option.value);
}

std::string synopsis(const CommandHelp& command) {
  std::istringstream words(command.usage());
  std::string line;
  bool isName = true;
  for (std::string word; words >> word;) {
    const bool isWord = isName && std::islower(static_cast<unsigned char>(word.front())) != 0;
    isName = isWord;
    const bool isOption = word.starts_with('-');
    line += (line.empty() ? "" : " ") + (isWord || isOption ? bold(word) : italic(word));
  }
  return line + '\n';
}

std::string argumentsText(const CommandHelp& command) {
  std::string text;
  for (const OptionHelp& argument : command.arguments)
    text += entry(italic(argument.names.front()), sentenceOf(argument));
  return text;
}

std::string optionsText(const CommandHelp& command) {
  std::string text;
  for (const std::string& group : command.groups()) {
    if (group != "Options") text += ".SS " + escaped(group) + '\n';
    for (const OptionHelp& option : command.options)
      if (option.group == group) text += entry(termOf(option), sentenceOf(option));
  }
  return text;
}

std::string examplesText(const std::vector<std::string>& examples) {
  std::string text = ".nf\n";
  for (const std::string& example : examples)
    text += escaped(example) + '\n';
  return text + ".fi\n";
}

/// Returns the commands of a command: all of each if it is not the program, whose commands have
/// pages of their own.
std::string commandsText(const CommandHelp& command) {
  std::string text;
  std::string group;
  for (const CommandHelp& below : command.commands) {
    if (!command.name.empty()) {
      text += section("carom " + below.name) + escaped(below.summary) + ".\n.PP\n" +
              synopsis(below) + argumentsText(below) + optionsText(below);
      continue;
    }
    if (below.group != group) text += ".SS " + escaped(below.group) + '\n';
    group = below.group;
    text += entry(bold(pageName(below)) + "(1)", below.summary);
  }
  return text;
}

/// Returns the notes: lines that end with a colon are headings, indented ones entries below them.
std::string notesText(const std::string& notes) {
  std::string text;
  std::istringstream lines(notes);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty()) continue;
    const std::size_t gap = line.find("  ", 2);
    if (line.ends_with(':')) {
      text += section(line.substr(0, line.size() - 1));
    } else if (line.starts_with("  ") && gap != std::string::npos) {
      text += entry(bold(line.substr(2, gap - 2)), line.substr(line.find_first_not_of(' ', gap)));
    } else {
      text += (text.empty() ? section("notes") : ".PP\n") + escaped(line) + '\n';
    }
  }
  return text;
}

std::string seeAlso(const CommandHelp& program, const CommandHelp& command) {
  std::string text;
  if (!command.name.empty()) text = bold("carom") + "(1)";
  for (const CommandHelp& other : program.commands) {
    if (other.name == command.name || (!command.name.empty() && other.group != command.group))
      continue;
    text += (text.empty() ? "" : ",\n") + bold(pageName(other)) + "(1)";
  }
  return section("see also") + text + '\n';
}

}  // namespace

std::string manualPage(const CommandHelp& program, const CommandHelp& command) {
  std::string text = ".TH " + upperCase(escaped(pageName(command))) + " 1 \"" + dateText() +
                     "\" \"carom " + CAROM_VERSION + "\" \"User Commands\"\n";
  text += section("name") + escaped(pageName(command)) + " \\- " + escaped(command.summary) + '\n';
  text += section("synopsis") + synopsis(command);
  text += section("description") + escaped(command.summary) +
          (command.summary.ends_with('.') ? "\n" : ".\n");
  if (!command.purpose.empty()) text += escaped(command.purpose) + '\n';
  if (command.name.empty()) text += section("commands");
  text += commandsText(command);
  if (!command.arguments.empty()) text += section("arguments") + argumentsText(command);
  text += section("options") + optionsText(command);
  if (!command.examples.empty()) text += section("examples") + examplesText(command.examples);
  return text + notesText(command.notes) + seeAlso(program, command);
}

}  // namespace carom::command
