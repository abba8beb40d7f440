#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace carom::command {

// The definitions of commands and options, read from the parser itself: help, manual pages and
// completion are made of them, and cannot say anything else than what is parsed.

/// The values that a shell can offer for an option or an argument.
struct Offer {
  std::vector<std::string> words;
  bool files = false;
  bool folders = false;
  bool scenes = false;     ///< of the library, by name
  bool materials = false;  ///< built-in ones, by name
  bool commands = false;
  bool isEmpty() const {
    return words.empty() && !files && !folders && !scenes && !materials && !commands;
  }
};

/// An option, or an argument of a command.
struct OptionHelp {
  std::vector<std::string> names;  ///< "-o", "--output"; of an argument: "SCENE"
  std::string value;               ///< "FILE.wav"; empty for what takes none
  std::string text;                ///< a sentence without its default
  std::string range;               ///< "a number of seconds from 0 to 60"; empty if it has none
  std::string standard;            ///< the value without it, in words; empty if there is none
  std::string group;
  Offer offer;
  bool isRequired = false;
  bool isRepeated = false;            ///< takes more than one value
  std::vector<std::string> excludes;  ///< options that it does not go with
  std::vector<std::string> needs;     ///< options that it goes with only
};

struct CommandHelp {
  std::string name;     ///< "batch run"; empty for the program itself
  std::string summary;  ///< one line
  std::string purpose;  ///< sentences for whom the line is too short; may be empty
  std::string group;
  std::vector<OptionHelp> arguments;
  std::vector<OptionHelp> options;
  std::vector<std::string> examples;  ///< command lines
  std::string notes;                  ///< lines behind the options
  std::vector<CommandHelp> commands;

  /// The headings of options, in the order of their first options.
  std::vector<std::string> groups() const;
  /// "carom render [OPTIONS] SCENE"
  std::string usage() const;
};

/// Returns what `app` parses. The first line of a description is the summary, the rest the purpose;
/// of a footer, indented lines below "Example:" or "Examples:" are examples. Hidden commands and
/// options, of an empty group, are left out.
CommandHelp helpOf(CLI::App& app);

/// Returns the command that is called so: one of `all`, or of its commands; null if there is none.
const CommandHelp* findCommand(const CommandHelp& all, const std::vector<std::string>& words);

/// Returns the word in a list of words for people: "a, b or c".
std::string wordList(const std::vector<std::string>& words);

}  // namespace carom::command
