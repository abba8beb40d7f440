#include "command/help/completion.h"

#include <algorithm>
#include <string_view>
#include <vector>

namespace carom::command {
namespace {

/// Calls `use` with each command that takes options: not the program itself.
template <class Use>
void forEachCommand(const CommandHelp& program, const Use& use) {
  for (const CommandHelp& command : program.commands) {
    use(command);
    for (const CommandHelp& below : command.commands)
      use(below);
  }
}

std::string joined(const std::vector<std::string>& words, std::string_view separator) {
  std::string text;
  for (const std::string& word : words)
    text += (text.empty() ? "" : std::string(separator)) + word;
  return text;
}

/// Returns the text in single quotes for a shell of the family of sh.
std::string shellQuoted(std::string_view text) {
  std::string safe = "'";
  for (const char letter : text)
    safe += letter == '\'' ? "'\\''" : std::string(1, letter);
  return safe + '\'';
}

/// Returns the beginning of a description, for a list in which each has a line.
std::string brief(const std::string& text) {
  return text.substr(0, std::min(text.find("; "), text.find(": ")));
}

std::vector<std::string> lastWords(const std::vector<CommandHelp>& commands) {
  std::vector<std::string> words;
  for (const CommandHelp& command : commands)
    words.push_back(command.name.substr(command.name.rfind(' ') + 1));
  return words;
}

std::vector<std::string> optionNames(const CommandHelp& command) {
  std::vector<std::string> names;
  for (const OptionHelp& option : command.options)
    names.insert(names.end(), option.names.begin(), option.names.end());
  return names;
}

/// Returns what all arguments of a command together take.
Offer argumentsOffer(const CommandHelp& command) {
  Offer all;
  for (const OptionHelp& argument : command.arguments) {
    const Offer& offer = argument.offer;
    all.words.insert(all.words.end(), offer.words.begin(), offer.words.end());
    all.files |= offer.files;
    all.folders |= offer.folders;
    all.scenes |= offer.scenes;
    all.materials |= offer.materials;
    all.commands |= offer.commands;
  }
  return all;
}

// ---- bash

/// Returns what offers it, as arguments of _carom_offer.
std::string bashOffer(Offer offer, const std::vector<std::string>& commands) {
  if (offer.commands) offer.words.insert(offer.words.end(), commands.begin(), commands.end());
  std::string words;
  if (!offer.words.empty()) words += " words " + shellQuoted(joined(offer.words, " "));
  for (const auto& [isOffered, kind] : {std::pair{offer.scenes, "scenes"},
                                        {offer.materials, "materials"},
                                        {offer.folders, "folders"},
                                        {offer.files, "files"}})
    if (isOffered) words += std::string(" ") + kind + " ''";
  return words;
}

/// Returns the cases of options that take something.
std::string bashOptions(const CommandHelp& command, const std::vector<std::string>& commands) {
  std::string text;
  for (const OptionHelp& option : command.options) {
    if (option.value.empty()) continue;
    std::vector<std::string> patterns;
    for (const std::string& name : option.names)
      patterns.push_back(shellQuoted(command.name + ":" + name));
    const std::string offer = bashOffer(option.offer, commands);
    text += "    " + joined(patterns, " | ") + ") " +
            (offer.empty() ? "" : "_carom_offer" + offer + "; ") + "return ;;\n";
  }
  return text;
}

/// Returns the case of a command: its options, and what its arguments take.
std::string bashCase(const CommandHelp& command, const std::vector<std::string>& commands) {
  Offer offer = argumentsOffer(command);
  const std::vector<std::string> below = lastWords(command.commands);
  offer.words.insert(offer.words.end(), below.begin(), below.end());
  return "    " + shellQuoted(command.name) +
         ")\n      options=" + shellQuoted(joined(optionNames(command), " ")) +
         "\n      arguments=(" + bashOffer(offer, commands) + ")\n      ;;\n";
}

constexpr const char* kBashHead =
    R"sh(# Completion of carom for bash, which 'carom completion bash' has printed.

# Adds to COMPREPLY what begins as the current word does: pairs of a kind and its words.
_carom_offer() {
  local IFS=$'\n'
  while [ $# -gt 0 ]; do
    case $1 in
      words) COMPREPLY+=($(IFS=' '; compgen -W "$2" -- "$cur")) ;;
      scenes | materials)
        COMPREPLY+=($(compgen -W "$("${COMP_WORDS[0]}" "$1" -q 2>/dev/null)" -- "$cur"))
        ;;
      folders)
        compopt -o filenames 2>/dev/null
        COMPREPLY+=($(compgen -d -- "$cur"))
        ;;
      files)
        compopt -o filenames 2>/dev/null
        COMPREPLY+=($(compgen -f -- "$cur"))
        ;;
    esac
    shift 2
  done
}

_carom() {
  local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD - 1]}
  local command= isProgram= options= arguments=() word i
  COMPREPLY=()
  if [ "$cur" = = ]; then
    cur=
  elif [ "$prev" = = ]; then
    prev=${COMP_WORDS[COMP_CWORD - 2]}
  fi
)sh";

// ---- zsh

/// Returns text for the brackets or a message of _arguments.
std::string zshText(const std::string& text) {
  std::string safe;
  for (const char letter : text) {
    if (letter == '[' || letter == ']' || letter == ':' || letter == '\\') safe += '\\';
    safe += letter;
  }
  return safe;
}

/// Returns the action that offers it: the function of kZshNames for two kinds at once.
std::string zshAction(const Offer& offer) {
  if (offer.commands) return "_carom_command_names";
  if (offer.scenes) return offer.files ? "_carom_scene_names_or_files" : "_carom_scene_names";
  if (offer.materials)
    return offer.files ? "_carom_material_names_or_files" : "_carom_material_names";
  if (offer.folders) return "_files -/";
  if (offer.files) return "_files";
  return offer.words.empty() ? " " : "(" + joined(offer.words, " ") + ")";
}

std::string zshOption(const OptionHelp& option) {
  std::string value;
  if (!option.value.empty()) value = ':' + zshText(option.value) + ':' + zshAction(option.offer);
  const std::string text = '[' + zshText(brief(option.text)) + ']';
  std::string lines;
  const std::string others = option.isRepeated ? "*" : '(' + joined(option.names, " ") + ')';
  for (const std::string& name : option.names) {
    const bool isLong = name.starts_with("--") && !option.value.empty();
    lines += " \\\n    " + shellQuoted(others + name + (isLong ? "=" : "") + text + value);
  }
  return lines;
}

std::string zshFunction(const std::string& name) {
  std::string function = "_carom_" + name;
  std::ranges::replace(function, ' ', '_');
  return function;
}

/// Returns the list of commands for _describe.
std::string zshCommands(const std::string& function, const std::vector<CommandHelp>& commands) {
  std::string text = function + "() {\n  local -a names=(";
  for (const CommandHelp& command : commands)
    text += "\n    " + shellQuoted(command.name.substr(command.name.rfind(' ') + 1) + ":" +
                                   zshText(command.summary));
  return text + ")\n  _describe command names\n}\n\n";
}

/// Returns the function of a command that has commands itself.
std::string zshParent(const CommandHelp& command, const std::string& function,
                      const std::string& commands) {
  std::string text = function + "() {\n  local curcontext=$curcontext state\n  local -a line\n";
  if (command.name.empty()) text += "  local carom=$words[1]\n";
  text += "  _arguments -C -S";
  for (const OptionHelp& option : command.options)
    text += zshOption(option);
  text += " \\\n    '1:command:" + commands + "' \\\n    '*::argument:->argument'\n";
  text += "  [[ $state = argument ]] || return\n  case $line[1] in\n";
  for (const CommandHelp& below : command.commands)
    text += "    " + below.name.substr(below.name.rfind(' ') + 1) + ") " + zshFunction(below.name) +
            " ;;\n";
  return text + "  esac\n}\n\n";
}

std::string zshLeaf(const CommandHelp& command) {
  std::string text = zshFunction(command.name) + "() {\n  _arguments -S";
  for (const OptionHelp& option : command.options)
    text += zshOption(option);
  for (const OptionHelp& argument : command.arguments)
    text += " \\\n    " +
            shellQuoted((argument.isRepeated   ? "*:"
                         : argument.isRequired ? ":"
                                               : "::") +
                        zshText(argument.names.front()) + ':' + zshAction(argument.offer));
  if (command.arguments.empty()) text += " \\\n    '*:argument:_files'";
  return text + "\n}\n\n";
}

constexpr const char* kZshNames = R"sh(_carom_scene_names() {
  local -a names=(${(f)"$(${(Q)carom} scenes -q 2>/dev/null)"})
  _wanted scenes expl scene compadd -a names
}

_carom_material_names() {
  local -a names=(${(f)"$(${(Q)carom} materials -q 2>/dev/null)"})
  _wanted materials expl material compadd -a names
}

_carom_scene_names_or_files() {
  _alternative 'scenes:scene:_carom_scene_names' 'files:file:_files'
}

_carom_material_names_or_files() {
  _alternative 'materials:material:_carom_material_names' 'files:file:_files'
}

)sh";

// ---- fish

std::string fishQuoted(std::string_view text) {
  std::string safe = "'";
  for (const char letter : text) {
    if (letter == '\'' || letter == '\\') safe += '\\';
    safe += letter;
  }
  return safe + '\'';
}

/// Returns the options of `complete` that offer it; files are the shell's own.
std::string fishOffer(const Offer& offer) {
  std::vector<std::string> words = offer.words;
  if (offer.commands) words.emplace_back("(__carom_commands)");
  if (offer.scenes) words.emplace_back("(__carom_names scenes)");
  if (offer.materials) words.emplace_back("(__carom_names materials)");
  if (offer.folders) words.emplace_back("(__fish_complete_directories)");
  std::string text = offer.files ? " -F" : " -f";
  if (!words.empty()) text += " -a " + fishQuoted(joined(words, " "));
  return text;
}

std::string fishLine(const std::string& name) {
  return "complete -c carom -n " + fishQuoted(name.empty() ? "__carom_at" : "__carom_at " + name);
}

std::string fishOptions(const CommandHelp& command) {
  std::string text;
  for (const OptionHelp& option : command.options) {
    text += fishLine(command.name);
    for (const std::string& name : option.names)
      text += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
    if (!option.value.empty()) text += " -r" + fishOffer(option.offer);
    text += " -d " + fishQuoted(brief(option.text)) + '\n';
  }
  return text;
}

std::string fishCommands(const CommandHelp& command) {
  std::string text;
  for (const CommandHelp& below : command.commands)
    text += fishLine(command.name) + " -a " + below.name.substr(below.name.rfind(' ') + 1) +
            " -d " + fishQuoted(below.summary) + '\n';
  return text;
}

constexpr const char* kFishHead =
    R"sh(# Completion of carom for fish, which 'carom completion fish' has printed.

# True if the words so far call the command that is given, or none if none is given.
function __carom_at
    set -l words (commandline -opc)
    set -l called
    for word in $words[2..-1]
        string match -q -- '-*' $word; and continue
        set -a called $word
        contains -- $word $__carom_parents; or break
    end
    test "$called" = "$argv"
end

# The names that 'carom scenes' or 'carom materials' lists.
function __carom_names
    set -l words (commandline -opc)
    $words[1] $argv[1] -q 2>/dev/null
end

)sh";

}  // namespace

std::string bashCompletion(const CommandHelp& program) {
  const std::vector<std::string> commands = lastWords(program.commands);
  std::vector<std::string> calls;  // what was called before, and the word that calls more
  std::string options;
  std::string cases = bashCase(program, commands);
  forEachCommand(program, [&](const CommandHelp& command) {
    const bool isBelow = command.name.find(' ') != std::string::npos;
    calls.push_back(shellQuoted((isBelow ? "" : " ") + command.name));
    options += bashOptions(command, commands);
    cases += bashCase(command, commands);
  });
  return kBashHead + std::string("  for ((i = 1; i < COMP_CWORD; i++)); do\n") +
         "    word=${COMP_WORDS[i]}\n    [ \"$word\" = -- ] && isProgram=1\n" +
         "    case \"$command $word\" in\n      " + joined(calls, " | ") +
         ") command=\"${command:+$command }$word\" ;;\n    esac\n  done\n" +
         "  if [ -n \"$isProgram\" ]; then\n    _carom_offer files ''\n    return\n  fi\n" +
         "  case \"$command:$prev\" in\n" + options + "  esac\n  case \"$command\" in\n" + cases +
         "  esac\n  case \"$cur\" in\n    -*) _carom_offer words \"$options\" ;;\n" +
         "    *) _carom_offer \"${arguments[@]}\" ;;\n  esac\n}\n\ncomplete -F _carom carom\n";
}

std::string zshCompletion(const CommandHelp& program) {
  std::string text =
      "#compdef carom\n# Completion of carom for zsh, which 'carom completion zsh' has "
      "printed.\n\n";
  text += kZshNames + zshCommands("_carom_command_names", program.commands);
  forEachCommand(program, [&](const CommandHelp& command) {
    const std::string function = zshFunction(command.name);
    if (command.commands.empty()) {
      text += zshLeaf(command);
      return;
    }
    text += zshCommands(function + "_commands", command.commands) +
            zshParent(command, function, function + "_commands");
  });
  return text + zshParent(program, "_carom", "_carom_command_names") +
         "if [[ $funcstack[1] = _carom ]]; then\n  _carom \"$@\"\nelse\n  compdef _carom "
         "carom\nfi\n";
}

std::string fishCompletion(const CommandHelp& program) {
  std::vector<std::string> parents;
  for (const CommandHelp& command : program.commands)
    if (!command.commands.empty()) parents.push_back(command.name);
  std::string text = kFishHead;
  text += "set -g __carom_parents " + joined(parents, " ") + "\n\nfunction __carom_commands\n" +
          "    string split ' ' -- " + fishQuoted(joined(lastWords(program.commands), " ")) +
          "\nend\n\ncomplete -c carom -f\n" + fishCommands(program) + fishOptions(program);
  forEachCommand(program, [&](const CommandHelp& command) {
    text += fishCommands(command) + fishOptions(command);
    const Offer offer = argumentsOffer(command);
    if (!offer.isEmpty()) text += fishLine(command.name) + fishOffer(offer) + '\n';
    if (command.arguments.empty() && command.commands.empty())
      text += fishLine(command.name) + " -F\n";
  });
  return text;
}

}  // namespace carom::command
