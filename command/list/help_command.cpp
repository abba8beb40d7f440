#include "command/list/help_command.h"

#include <filesystem>
#include <fstream>
#include <map>

#include "command/command_line.h"
#include "command/help/command_help.h"
#include "command/help/completion.h"
#include "command/help/help_text.h"
#include "command/help/manual_page.h"
#include "command/help/usage_error.h"
#include "command/terminal/terminal.h"
#include <CLI/CLI.hpp>

namespace carom::command {

namespace fs = std::filesystem;

namespace {

/// Returns manual pages and completions by their places below an installation's share/.
std::map<std::string, std::string> pagesOf(const CommandHelp& program) {
  std::map<std::string, std::string> pages = {
      {"man/man1/carom.1", manualPage(program, program)},
      {"bash-completion/completions/carom", bashCompletion(program)},
      {"zsh/site-functions/_carom", zshCompletion(program)},
      {"fish/vendor_completions.d/carom.fish", fishCompletion(program)}};
  for (const CommandHelp& command : program.commands)
    pages["man/man1/carom-" + command.name + ".1"] = manualPage(program, command);
  return pages;
}

int writePages(const CommandHelp& program, const fs::path& folder) {
  for (const auto& [name, text] : pagesOf(program)) {
    const fs::path file = folder / name;
    std::error_code failed;
    fs::create_directories(file.parent_path(), failed);
    std::ofstream stream(file, std::ios::binary);
    stream << text;
    stream.close();
    if (!stream) return fail(kFailed, file.string() + ": cannot be written");
  }
  return kDone;
}

}  // namespace

HelpCommand::HelpCommand(CLI::App& app)
    : app_(app), command_(app.add_subcommand("help", "Say what a command is for and takes")) {
  command_->add_option("COMMAND", words_, "the command, such as: render, or: batch run");
  command_->add_option("--write-pages", pages_, "folder for manual pages and completions")
      ->check(folderName())
      ->group("");  // for the build
  command_->footer(
      "Examples:\n"
      "  carom help render\n"
      "  carom help batch run");
}

bool HelpCommand::parsed() const {
  return command_->parsed();
}

int HelpCommand::run() const {
  const CommandHelp program = helpOf(app_);
  if (!pages_.empty()) return writePages(program, pages_);
  const CommandHelp* const found = findCommand(program, words_);
  if (found != nullptr) return answer(helpText(*found, textWidth()));
  const bool isBelow = words_.size() > 1 && findCommand(program, {words_.front()}) != nullptr;
  return fail(kBadInput, unknownCommand(isBelow ? *app_.get_subcommand(words_.front()) : app_,
                                        isBelow ? words_[1] : words_.front()) +
                             "; 'carom help' lists them");
}

}  // namespace carom::command
