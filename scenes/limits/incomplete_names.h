#pragma once

#include <filesystem>
#include <map>

#include "carom/audio/result.h"

namespace carom::scenes {

/// The names that the files of a run have until it is complete, if what a limit cuts off is to be
/// kept: "out.incomplete.wav" for "out.wav", or "out.incomplete-2.wav" and so on, as nothing that
/// is there already is replaced. [one thread]
class IncompleteNames {
 public:
  /// Without `keepPartial` files have their own names from the beginning on, and appear when they
  /// are whole.
  explicit IncompleteNames(bool keepPartial = false) : keepPartial_(keepPartial) {}

  /// Returns the name of a file until the run is complete, the same at each call.
  const std::filesystem::path& of(const std::filesystem::path& file);

  /// Gives all files their names.
  Status complete();

 private:
  bool keepPartial_;
  std::map<std::filesystem::path, std::filesystem::path> names_;  // by the final name
};

}  // namespace carom::scenes
