#pragma once

#include <optional>
#include <string>

#include "audio/io/partial_file.h"
#include "carom/audio/result.h"

namespace carom::command {

/// The name by which a command line means standard output.
inline constexpr const char* kStandardOutput = "-";

/// A file that a command writes: one of a name, or standard output. The latter is written into the
/// folder for temporary files first, so that it arrives whole or not at all, and headers that are
/// written last stand where they belong. Meanwhile answers go to standard error. [one thread]
class OutputTarget {
 public:
  /// Refuses standard output where it is a terminal; the message begins with `option`.
  static Result<OutputTarget> create(const std::string& name, const std::string& option);

  /// The path to write to.
  const std::string& path() const { return path_; }
  /// The name for people.
  const std::string& shown() const { return shown_; }
  bool isStandardOutput() const { return file_.has_value(); }

  /// Sends what was written to standard output, if that is meant. To be called once, at the end.
  Status finish() const;

 private:
  OutputTarget() = default;

  std::optional<audio::PartialFile> file_;  // removed with this object, and on signals
  std::string path_;
  std::string shown_;
};

/// Refuses standard output for `option`, whose files cannot go there; `why` is half a sentence.
Status refuseStandardOutput(const std::string& name, const std::string& option,
                            const std::string& why);

}  // namespace carom::command
