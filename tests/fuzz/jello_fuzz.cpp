#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "native/jello/jello_file.h"

namespace {

void require(bool promise) {
  if (!promise) std::abort();
}

}  // namespace

/// Requires that any text gives either a world that can be written and read again unchanged, or an
/// error with the file's name.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto file = carom::native::jelloFromText(text, "fuzz.w");
  if (!file) {
    require(std::string_view(file.error().message).starts_with("fuzz.w: "));
    return 0;
  }
  require(static_cast<bool>(carom::native::validate(file->world)));
  const auto written = carom::native::jelloText(*file);
  require(static_cast<bool>(written));
  const auto again = carom::native::jelloFromText(*written, "again.w");
  require(static_cast<bool>(again));
  require(again->world.positions == file->world.positions);
  require(again->world.velocities == file->world.velocities);
  require(again->world.field.forces == file->world.field.forces);
  return 0;
}
