#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string_view>

#include "carom/audio/normal_map.h"

namespace {

void require(bool promise) {
  if (!promise) std::abort();
}

}  // namespace

/// Requires that any bytes give either a picture whose slopes are numbers, or an error that names
/// it.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto map =
      carom::normalMapFromBytes(std::as_bytes(std::span(data, size)), "fuzz", {.size = {0.1, 0.2}});
  if (!map) {
    require(std::string_view(map.error().message).starts_with("normal map 'fuzz': "));
    return 0;
  }
  for (const double width : {0.0, 1e-3, 1.0})
    require(map->slope({0.01, -0.3}, width).allFinite());
  require(std::isfinite(map->steepest()) && map->widthOf(100.0) >= 0.0);
  return 0;
}
