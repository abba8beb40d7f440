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

#include "audio/run/host_run.h"
#include "audio/run/run_tables.h"
#include "scenes/recording/run_file.h"

namespace {

using carom::audio::RunPortion;
using carom::audio::RunShape;
using carom::scenes::RunReader;

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
    for (const carom::audio::BodyPose& pose : portion.poses)
      require(pose.body < shape.bodies && pose.pose.position.allFinite());
    for (const carom::audio::JelloPicture& picture : portion.pictures)
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
  const auto portions = carom::audio::decodedPortions(bytes, shape);
  if (!portions) {
    require(!portions.error().message.empty());
    return;
  }
  requireSound(*portions, shape);
  const auto again = carom::audio::encodedPortions(*portions);
  const auto twice = carom::audio::decodedPortions(again, shape);
  require(twice && carom::audio::encodedPortions(*twice) == again);
}

/// Requires that bodies which are read can be written, and have the same bytes then.
void readBodies(std::span<const std::byte> bytes) {
  const auto bodies = carom::audio::HostDecoder().take(bytes);
  if (!bodies) {
    require(!bodies.error().message.empty());
    return;
  }
  const auto written = [](const std::vector<carom::audio::HostBody>& all) {
    std::vector<std::byte> to;
    carom::audio::HostEncoder encoder;
    for (const carom::audio::HostBody& body : all) {
      require(bool(validate(body.sound)));
      require(bool(encoder.add(body, to)));
    }
    return to;
  };
  const std::vector<std::byte> again = written(*bodies);
  const auto twice = carom::audio::HostDecoder().take(again);
  require(twice && written(*twice) == again);
}

/// The same of a world, whose paths have to be such as a scene takes.
void readWorld(std::span<const std::byte> bytes) {
  const auto world = carom::audio::decodedWorld(bytes);
  if (!world) {
    require(!world.error().message.empty());
    return;
  }
  require(world->duration > 0.0 && world->paths.size() == world->listeners.size());
  const auto again = carom::audio::encodedWorld(*world);
  const auto twice = carom::audio::decodedWorld(again);
  require(twice && carom::audio::encodedWorld(*twice) == again);
}

}  // namespace

/// The first byte says what the others are: 0 a file, any other tables of a scene of some bodies,
/// which stand unpacked and without a checksum; 254 and 255 the bodies and the world of a host.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const auto bytes = std::as_bytes(std::span(data + 1, size - 1));
  if (data[0] == 0)
    readFile(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  else if (data[0] == 254)
    readBodies(bytes);
  else if (data[0] == 255)
    readWorld(bytes);
  else
    readTables(bytes, {.bodies = data[0] % 16U, .points = data[0] / 16U % 4U});
  return 0;
}
