#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <set>
#include <string_view>

#include "command/list/collision_list.h"

namespace {

void require(bool promise) {
  if (!promise) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto collisions = carom::command::readCollisions(text, "events.csv");
  if (!collisions) {
    require(collisions.error().message.starts_with("events.csv: line "));
    return 0;
  }
  std::set<std::uint64_t> numbers;
  for (const carom::command::ListedCollision& collision : *collisions) {
    require(collision.number > 0 && numbers.insert(collision.number).second);
    require(std::isfinite(collision.time) && std::isfinite(collision.peak));
  }
  const auto three = carom::command::loudest(*collisions, 3);
  require(three.size() == std::min<std::size_t>(3, collisions->size()));
  for (std::size_t row = 1; row < three.size(); ++row)
    require(three[row - 1].peak >= three[row].peak);
  return 0;
}
