#include "command/list/completion_command.h"

#include "command/command_line.h"
#include "command/help/command_help.h"
#include "command/help/completion.h"
#include <CLI/CLI.hpp>

namespace carom::command {

CompletionCommand::CompletionCommand(CLI::App& app)
    : app_(app),
      command_(app.add_subcommand(
          "completion",
          "Print what makes a shell complete commands, options and names\n"
          "Packages install it for all users; this is for a program that was built and not "
          "installed.")) {
  command_->add_option("SHELL", shell_, "the shell that is to complete")
      ->required()
      ->check(oneOf({"bash", "zsh", "fish"}));
  command_->footer(
      "Examples:\n"
      "  source <(carom completion bash)\n"
      "  source <(carom completion zsh)\n"
      "  carom completion fish | source");
}

bool CompletionCommand::parsed() const {
  return command_->parsed();
}

int CompletionCommand::run() const {
  const CommandHelp program = helpOf(app_);
  if (shell_ == "zsh") return answer(zshCompletion(program));
  return answer(shell_ == "fish" ? fishCompletion(program) : bashCompletion(program));
}

}  // namespace carom::command
