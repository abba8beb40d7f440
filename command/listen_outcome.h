#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace carom::command {

/// The recording of one world of a program that was listened to.
struct ListenedWorld {
  std::string file;         ///< as the user named it, or what is kept of it; empty: none
  std::string precision;    ///< of its Bullet: "float" or "double"
  bool isComplete = false;  ///< false if the program ended in its midst
  std::optional<std::uint64_t> events;  ///< two for each collision; unknown unless complete
  std::optional<double> peak;           ///< Pa, likewise
  double duration = 0.0;                ///< s
  std::optional<double> fullScale;      ///< Pa for a sample of 1.0
};

/// The outcome of a program that was listened to.
struct ListenOutcome {
  int exitCode = 0;
  std::vector<ListenedWorld> worlds;  ///< in the order of their first steps
  std::vector<std::string> messages;  ///< sentences for the user
};

/// Reads the report that a program has left in the folder, and looks at the sound files; `output`
/// is the name that the user gave. Gives what a program that ended early has recorded a name.
ListenOutcome readOutcome(const std::filesystem::path& folder, const std::string& output);

/// Returns lines for people: one for each world, or why there is none, of that program.
std::string outcomeText(const ListenOutcome& outcome, const std::string& program);

/// Returns the same as JSON; those of the first world stand at the top, too.
nlohmann::ordered_json outcomeJson(const ListenOutcome& outcome, const std::string& program);

}  // namespace carom::command
