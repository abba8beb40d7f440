#include "command/help/usage_error.h"

#include <algorithm>
#include <string_view>
#include <vector>

#include "command/terminal/terminal.h"
#include <CLI/CLI.hpp>

#include "modal/json/json_reader.h"

namespace carom::command {
namespace {

/// Returns "carom batch run".
std::string nameOf(const CLI::App& command) {
  const CLI::App* const parent = command.get_parent();
  return parent == nullptr ? command.get_name() : nameOf(*parent) + ' ' + command.get_name();
}

bool isOption(const std::string& word) {
  return word.size() > 1 && word.front() == '-';
}

std::string unknownOption(CLI::App& command, const std::string& word) {
  const std::string name = word.substr(0, word.find('='));
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options())
    for (const std::string& known : option->get_lnames())
      names.push_back("--" + known);
  std::vector<std::string_view> views(names.begin(), names.end());
  return "unknown option " + modal::inQuotes(name) + modal::suggestion(name, views);
}

/// Returns the error of a word that nothing takes.
std::string unexpected(CLI::App& command, const std::string& word) {
  if (isOption(word)) return unknownOption(command, word);
  if (!command.get_subcommands([](CLI::App*) { return true; }).empty())
    return unknownCommand(command, word);
  return modal::inQuotes(word) + " is one word too many";
}

/// Returns the words that nothing has taken; options first.
std::string firstLeft(const CLI::App& command) {
  const std::vector<std::string> left = command.remaining();
  const auto option = std::ranges::find_if(left, isOption);
  if (option != left.end()) return *option;
  return left.empty() ? std::string() : left.front();
}

}  // namespace

CLI::App& parsedCommand(CLI::App& app) {
  const std::vector<CLI::App*> parsed = app.get_subcommands();
  return parsed.empty() ? app : parsedCommand(*parsed.front());
}

std::vector<std::string> wordsOf(const CLI::App& command) {
  if (command.get_parent() == nullptr) return {};
  std::vector<std::string> words = wordsOf(*command.get_parent());
  words.push_back(command.get_name());
  return words;
}

std::string unknownCommand(CLI::App& app, const std::string& word) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](CLI::App*) { return true; }))
    if (!command->get_group().empty()) names.push_back(command->get_name());
  const std::vector<std::string_view> views(names.begin(), names.end());
  return "unknown command " + modal::inQuotes(word) + modal::suggestion(word, views);
}

std::string usageErrorText(CLI::App& app, const CLI::Error& error) {
  CLI::App* at = &app;
  if (app.remaining().empty()) at = &parsedCommand(app);
  const std::string word = firstLeft(*at);
  const std::string why = word.empty() ? error.what() : unexpected(*at, word);
  const std::string name = nameOf(*at);
  return styled(name + ":", Style::error, Stream::err) + ' ' + why + '\n' +
         (at == &app ? "'carom help' lists the commands and options\n"
                     : "'" + name + " --help' shows what is expected\n");
}

}  // namespace carom::command
