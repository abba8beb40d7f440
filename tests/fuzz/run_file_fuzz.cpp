#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "audio/run/head_code.h"
#include "audio/run/host_run.h"
#include "audio/run/playable_run.h"
#include "audio/run/run_player.h"
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

/// Requires that a run in memory which is read can be written, and have the same bytes then; and
/// plays its begin.
void readRun(std::span<const std::byte> bytes) {
  auto run = carom::audio::decodedRun(bytes);
  if (!run) {
    require(!run.error().message.empty());
    return;
  }
  requireSound(run->portions, {.bodies = run->world.bodies, .points = 0});
  const auto again = carom::audio::encodedRun(*run);
  require(bool(again));
  const auto twice = carom::audio::decodedRun(*again);
  require(twice && *carom::audio::encodedRun(*twice) == *again);
  constexpr std::size_t kFrames = 256;
  auto player = carom::audio::RunPlayer::create(*std::move(run), 48000.0);
  if (!player) return;
  player->follow(0);
  if (!player->seek({.time = 0.1, .prelude = 0.005})) return;
  std::vector<float> samples(player->channels() * kFrames);
  std::vector<float*> channels;
  for (std::size_t channel = 0; channel < player->channels(); ++channel)
    channels.push_back(&samples[channel * kFrames]);
  player->render(channels, kFrames);
  for (const float sample : samples)
    require(std::isfinite(sample));
}

/// Requires that a head which is read can be written, and have the same bytes then.
void readHead(std::span<const std::byte> bytes) {
  const auto head = carom::audio::decodedHead(bytes);
  if (!head) {
    require(!head.error().message.empty());
    return;
  }
  const auto again = carom::audio::encodedHead(*head, bytes.size());
  require(std::ranges::equal(again, bytes));
}

}  // namespace

/// The first byte says what the others are: 0 a file, any other tables of a scene of some bodies,
/// which stand unpacked and without a checksum; 254 and 255 the bodies and the world of a host; 253
/// a whole run as a page has it, 252 a head.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const auto bytes = std::as_bytes(std::span(data + 1, size - 1));
  if (data[0] == 0)
    readFile(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  else if (data[0] == 252)
    readHead(bytes);
  else if (data[0] == 253)
    readRun(bytes);
  else if (data[0] == 254)
    readBodies(bytes);
  else if (data[0] == 255)
    readWorld(bytes);
  else
    readTables(bytes, {.bodies = data[0] % 16U, .points = data[0] / 16U % 4U});
  return 0;
}
