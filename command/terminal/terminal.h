#pragma once

#include <cstddef>
#include <string>

namespace carom::command {

// The way in which the program talks to people: how much, where to, and in which colours.

enum class Verbosity { quiet, normal, verbose };

/// The choices of the command line about what is said. Set once, before the command begins.
struct Talk {
  Verbosity verbosity = Verbosity::normal;
  bool isJson = false;         ///< the answer is for programs: it is given even if quiet
  bool isOutputTaken = false;  ///< a file goes to standard output, so answers go to standard error
  bool isVerbose() const { return verbosity == Verbosity::verbose; }
  bool isQuiet() const { return verbosity == Verbosity::quiet; }
};

/// The talk of this process. [one thread]
Talk& talk();

enum class Stream { out, err };

/// True if text on the stream may be coloured: it is a terminal, and neither NO_COLOR nor
/// TERM=dumb forbids it; CLICOLOR_FORCE allows it anywhere.
bool hasColour(Stream stream);

enum class Style { heading, name, error, warning };

/// Returns the text between the codes of the style, or as it is where the stream has no colour.
std::string styled(const std::string& text, Style style, Stream stream);

/// Returns the width for text on standard output: that of the terminal within 60 to 100, or 80.
std::size_t textWidth();

/// Prints "carom: TEXT" on standard error, as a warning.
void warn(const std::string& text);

}  // namespace carom::command
