#include "command/help/help_text.h"

#include <algorithm>
#include <sstream>
#include <vector>

#include "command/terminal/terminal.h"

namespace carom::command {
namespace {

constexpr std::size_t kIndent = 2;
constexpr std::size_t kColumn = 31;  // where the text of an option begins

std::string heading(const std::string& text) {
  return styled(text + ":", Style::heading, Stream::out) + '\n';
}

/// Breaks text between words, `first` letters being used in its first line and `indent` in others.
std::string wrapped(const std::string& text, std::size_t first, std::size_t indent,
                    std::size_t width) {
  std::string lines;
  std::istringstream words(text);
  std::size_t used = first;
  bool isFirst = true;
  for (std::string word; words >> word;) {
    if (!isFirst && used + 1 + word.size() > width) {
      lines += '\n' + std::string(indent, ' ');
      used = indent;
      isFirst = true;
    }
    if (!isFirst) lines += ' ';
    used += word.size() + (isFirst ? 0 : 1);
    lines += word;
    isFirst = false;
  }
  return lines + '\n';
}

/// Returns a row: a name, and its text beside or below it.
std::string row(const std::string& name, const std::string& text, std::size_t width) {
  std::string line = std::string(kIndent, ' ') + name;
  if (text.empty()) return line + '\n';
  if (line.size() + 2 > kColumn)
    line += '\n' + std::string(kColumn, ' ');
  else
    line.resize(kColumn, ' ');
  return line + wrapped(text, kColumn, kColumn, width);
}

/// Returns "-o, --output FILE.wav"; the long names of options without a short one are in line.
std::string namesOf(const OptionHelp& option) {
  std::string names = option.names.front().starts_with("--") ? "    " : "";
  for (std::size_t name = 0; name < option.names.size(); ++name)
    names += (name > 0 ? ", " : "") + option.names[name];
  return option.value.empty() ? names : names + ' ' + option.value;
}

std::string examplesText(const CommandHelp& help) {
  if (help.examples.empty()) return {};
  std::string text = '\n' + heading(help.examples.size() == 1 ? "Example" : "Examples");
  for (const std::string& example : help.examples)
    text += "  " + example + '\n';
  return text;
}

/// Returns the notes: lines that end with a colon are headings, indented ones entries below them.
std::string notesText(const std::string& notes, std::size_t width) {
  std::string text;
  std::istringstream lines(notes);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t gap = line.find("  ", 2);
    if (line.ends_with(':'))
      text += heading(line.substr(0, line.size() - 1));
    else if (line.starts_with("  ") && gap != std::string::npos)
      text += row(line.substr(2, gap - 2), line.substr(gap), width);
    else
      text += line.empty() ? "\n" : wrapped(line, 0, 0, width);
  }
  return text;
}

std::string commandsText(const CommandHelp& help, std::size_t width) {
  std::vector<std::string> groups;
  for (const CommandHelp& command : help.commands)
    if (std::ranges::find(groups, command.group) == groups.end()) groups.push_back(command.group);
  std::string text;
  for (const std::string& group : groups) {
    text += '\n' + heading(group);
    for (const CommandHelp& command : help.commands) {
      if (command.group != group) continue;
      std::string line = "  " + command.name.substr(command.name.rfind(' ') + 1);
      line.resize(std::max<std::size_t>(line.size() + 1, 14), ' ');
      text += line + wrapped(command.summary, line.size(), line.size(), width);
    }
  }
  return text;
}

}  // namespace

std::string sentenceOf(const OptionHelp& option) {
  std::vector<std::string> remarks;
  if (option.isRequired && option.names.front().starts_with('-')) remarks.emplace_back("required");
  if (!option.range.empty()) remarks.push_back(option.range);
  if (!option.standard.empty()) remarks.push_back("default: " + option.standard);
  if (!option.needs.empty()) remarks.push_back("only with " + wordList(option.needs));
  if (!option.excludes.empty()) remarks.push_back("not with " + wordList(option.excludes));
  std::string text = option.text;
  for (std::size_t remark = 0; remark < remarks.size(); ++remark)
    text += (remark > 0 ? "; " : text.empty() ? "(" : " (") + remarks[remark];
  return remarks.empty() ? text : text + ')';
}

std::string overviewText(const CommandHelp& program, std::size_t width) {
  return program.summary + "\n\n" + styled("Usage:", Style::heading, Stream::out) + ' ' +
         program.usage() + '\n' + commandsText(program, width) + examplesText(program) +
         "\n'carom help COMMAND' says more of one of them, 'carom help' all of the program.\n";
}

std::string helpText(const CommandHelp& help, std::size_t width) {
  std::string text = help.summary + '\n';
  if (!help.purpose.empty()) text += '\n' + wrapped(help.purpose, 0, 0, width);
  text += '\n' + styled("Usage:", Style::heading, Stream::out) + ' ' + help.usage() + '\n';
  text += commandsText(help, width);
  if (!help.arguments.empty()) text += '\n' + heading("Arguments");
  for (const OptionHelp& argument : help.arguments)
    text += row(argument.names.front() + (argument.isRepeated ? "..." : ""), sentenceOf(argument),
                width);
  for (const std::string& group : help.groups()) {
    text += '\n' + heading(group);
    for (const OptionHelp& option : help.options)
      if (option.group == group) text += row(namesOf(option), sentenceOf(option), width);
  }
  text += examplesText(help);
  if (!help.notes.empty()) text += '\n' + notesText(help.notes, width);
  return text;
}

}  // namespace carom::command
