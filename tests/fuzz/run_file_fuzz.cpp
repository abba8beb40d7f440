#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "scenes/recording/run_file.h"
#include "scenes/recording/run_tables.h"

namespace {

using carom::scenes::RunReader;
using carom::scenes::RunShape;
using carom::scenes::RunPortion;

void require(bool promise) {
  if (!promise) std::abort();
}

/// Requires what is handed to the synthesis without another look at its ids.
void requireSound(const std::vector<RunPortion>& portions, const RunShape& shape) {
  for (const RunPortion& portion : portions) {
    require(!std::isnan(portion.settledTime));
    for (const carom::ImpulseEvent& event : portion.events) {
      require(event.body < shape.bodies && event.other < shape.bodies);
      require(std::isfinite(event.time) && event.impulse.allFinite());
      require(event.radius >= 0.0 && std::abs(event.bodyOrientation.norm() - 1.0) < 0.01);
    }
    for (const carom::ContactState& contact : portion.contacts) {
      require(contact.body < shape.bodies && contact.other < shape.bodies);
      require(std::isfinite(contact.normalLoad) && contact.pathEnd.allFinite());
      require(contact.phase <= carom::ContactPhase::end);
    }
    for (const carom::scenes::BodyPose& pose : portion.poses)
      require(pose.body < shape.bodies && pose.pose.position.allFinite());
    for (const carom::scenes::JelloPicture& picture : portion.pictures)
      require(picture.points.size() == std::size_t{3} * shape.points);
  }
}

void readFile(const std::string& bytes) {
  auto reader = RunReader::read(std::make_unique<std::istringstream>(bytes), "fuzz.carom");
  while (reader) {
    const auto portions = reader->next();
    if (!portions) {
      require(std::string_view(portions.error().message).starts_with("fuzz.carom: "));
      return;
    }
    if (portions->empty()) return;
    requireSound(*portions, reader->header().shape);
  }
  require(std::string_view(reader.error().message).starts_with("fuzz.carom: "));
}

/// Requires that portions which are read can be written, and have the same bytes then.
void readTables(std::span<const std::byte> bytes, const RunShape& shape) {
  const auto portions = carom::scenes::decodedPortions(bytes, shape);
  if (!portions) {
    require(!portions.error().message.empty());
    return;
  }
  requireSound(*portions, shape);
  const auto again = carom::scenes::encodedPortions(*portions);
  const auto twice = carom::scenes::decodedPortions(again, shape);
  require(twice && carom::scenes::encodedPortions(*twice) == again);
}

}  // namespace

/// The first byte says what the others are: 0 a file, any other tables of a scene of some bodies,
/// which stand unpacked and without a checksum.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const auto bytes = std::as_bytes(std::span(data + 1, size - 1));
  if (data[0] == 0)
    readFile(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  else
    readTables(bytes, {.bodies = data[0] % 16U, .points = data[0] / 16U % 4U});
  return 0;
}
