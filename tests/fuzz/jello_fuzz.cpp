#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "native/jello/jello_file.h"

namespace {

using namespace carom::native;

void require(bool promise) {
  if (!promise) std::abort();
}

/// Requires that a world which no file can be of is not written.
void requireRefusal(JelloFile file, unsigned kind) {
  JelloWorld& world = file.world;
  switch (kind % 11) {
    case 0:
      world.balls.push_back({.id = 2, .radius = 0.1, .mass = 1.0});
      break;
    case 1:
      world.gravity.z() = -9.81;
      break;
    case 2:
      world.planes.assign(2, {.id = 1, .normal = carom::Vec3::UnitZ(), .offset = -1.0});
      break;
    case 3:
      world.lattice.count = 2;
      world.positions.resize(8);
      world.velocities.resize(8);
      break;
    case 4:
      world.lattice.size *= 2.0;
      break;
    case 5:
      world.room.reset();
      break;
    case 6:
      world.room->max.x() = 3.0;
      break;
    case 7:
      world.field.count = 1;
      world.field.min.setConstant(-1.0);
      world.field.max.setConstant(1.0);
      world.field.forces.assign(1, carom::Vec3::Zero());
      break;
    case 8:
      file.stepsPerFrame = 0;
      break;
    case 9:
      file.step = 0.0;
      break;
    default:
      world.lattice.pointMass = 0.0;
      break;
  }
  const auto written = jelloText(file);
  require(!written);
  require(std::string_view(written.error().message).starts_with("world file: "));
}

}  // namespace

/// Requires that any text gives either a world that can be written and read again unchanged, or an
/// error with the file's name, and that what such a file cannot say is not written.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto file = jelloFromText(text, "fuzz.w");
  if (!file) {
    require(std::string_view(file.error().message).starts_with("fuzz.w: "));
    return 0;
  }
  require(static_cast<bool>(validate(file->world)));
  const auto written = jelloText(*file);
  require(static_cast<bool>(written));
  const auto again = jelloFromText(*written, "again.w");
  require(static_cast<bool>(again));
  require(again->world.positions == file->world.positions);
  require(again->world.velocities == file->world.velocities);
  require(again->world.field.forces == file->world.field.forces);
  unsigned sum = 0;
  for (const char letter : text)
    sum += static_cast<unsigned char>(letter);
  requireRefusal(*file, sum);
  return 0;
}
