#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "carom/audio/result.h"
#include "carom/audio/vector.h"

namespace carom::command {

/// A collision as an events file tells of it, by both of its rows.
struct ListedCollision {
  std::uint64_t number = 0;      ///< of the file, from 1
  double time = 0.0;             ///< s
  std::string body;              ///< of the row that is louder
  std::string other;             ///< what it hit
  double impulse = 0.0;          ///< N s
  double approachSpeed = 0.0;    ///< m/s
  double peak = 0.0;             ///< Pa, upper bound at the loudest listener, of the louder row
  bool isHeard = false;          ///< either row is
  Vec3 position = Vec3::Zero();  ///< m
};

/// Reads the rows of `carom render --events` (EventRows). `name` begins messages. Columns are found
/// by their names; others may stand among them. Errors name the line, what is wrong with it, and
/// what would be accepted. [any thread]
Result<std::vector<ListedCollision>> readCollisions(std::string_view text, const std::string& name);

/// Returns the `count` loudest, the loudest first; of those that are equally loud the earlier.
std::vector<ListedCollision> loudest(std::vector<ListedCollision> collisions, std::size_t count);

}  // namespace carom::command
