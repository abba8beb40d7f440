#include "audio/run/playable_run.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "audio/io/field_code.h"
#include "audio/run/run_tables.h"
#include "audio/run/run_writer.h"

namespace carom::audio {
namespace {

constexpr std::uint32_t kRunBytesMagic = 0x6E757263;   // "crun"
constexpr std::uint32_t kMoreBytesMagic = 0x726F6D63;  // "cmor"

struct EncodedBodies {
  std::uint64_t portion = 0;
  std::vector<std::byte> records;
};

/// A PlayableRun whose parts are encoded, without its portions.
struct EncodedRun {
  std::uint32_t magic = kRunBytesMagic;
  bool keepsOrder = false;
  double deformationStep = 0.0;
  std::vector<std::byte> world;
  std::vector<EncodedBodies> bodies;
};

void codeBodies(auto& archive, auto& list) {
  archive.count(list, 2 * sizeof(std::uint64_t));
  for (auto& bodies : list) {
    archive.number(bodies.portion);
    archive.bytes(bodies.records);
  }
}

void codeRun(auto& archive, auto& run) {
  archive.number(run.magic);
  archive.flag(run.keepsOrder);
  archive.number(run.deformationStep);
  archive.bytes(run.world);
  codeBodies(archive, run.bodies);
}

/// Encodes bodies, with what they share once.
Result<std::vector<EncodedBodies>> encodedBodies(const std::vector<PlayableRun::Bodies>& list) {
  HostEncoder encoder;
  std::vector<EncodedBodies> encoded;
  for (const PlayableRun::Bodies& bodies : list) {
    EncodedBodies& records = encoded.emplace_back(EncodedBodies{bodies.portion, {}});
    for (const HostBody& body : bodies.bodies)
      if (Status added = encoder.add(body, records.records); !added) return added.error();
  }
  return encoded;
}

/// Decodes bodies, of which each has to be one of so many.
Result<std::vector<PlayableRun::Bodies>> decodedBodies(const std::vector<EncodedBodies>& encoded,
                                                       std::uint32_t mostBodies) {
  HostDecoder decoder;
  std::vector<PlayableRun::Bodies> list;
  for (const EncodedBodies& bodies : encoded) {
    Result<std::vector<HostBody>> taken = decoder.take(bodies.records);
    if (!taken) return taken.error();
    const auto isStrange = [mostBodies](const HostBody& body) { return body.id >= mostBodies; };
    if (std::ranges::any_of(*taken, isStrange)) return Error{"has a body with too high a number"};
    if (!list.empty() && list.back().portion > bodies.portion)
      return Error{"has bodies that are not in order"};
    list.push_back({bodies.portion, *std::move(taken)});
  }
  return list;
}

}  // namespace

std::vector<EventPlace> eventsInOrder(const PlayableRun& run) {
  std::vector<EventPlace> places;
  const auto timeOf = [&run](const EventPlace& place) {
    return run.portions[place.portion].events[place.event].time;
  };
  for (std::size_t portion = 0; portion < run.portions.size(); ++portion)
    for (std::size_t event = 0; event < run.portions[portion].events.size(); ++event)
      if (run.portions[portion].events[event].time <= run.world.duration)
        places.push_back({portion, event});
  std::ranges::stable_sort(places, {}, timeOf);
  return places;
}

Result<EncodedRunParts> encodedRunParts(const PlayableRun& run) {
  EncodedRun encoded;
  encoded.world = encodedWorld(run.world);
  Result<std::vector<EncodedBodies>> bodies = encodedBodies(run.bodies);
  if (!bodies) return bodies.error();
  encoded.bodies = *std::move(bodies);
  encoded.keepsOrder = run.keepsOrder;
  encoded.deformationStep = run.deformationStep;
  const std::vector<std::byte> portions = encodedPortions(run.portions);
  EncodedRunParts parts;
  FieldWriter head(parts.sound);
  codeRun(head, std::as_const(encoded));
  FieldWriter tail(parts.portions);
  tail.bytes(portions);
  return parts;
}

Result<std::vector<std::byte>> encodedRun(const PlayableRun& run) {
  Result<EncodedRunParts> parts = encodedRunParts(run);
  if (!parts) return parts.error();
  std::vector<std::byte> bytes = std::move(parts->sound);
  bytes.insert(bytes.end(), parts->portions.begin(), parts->portions.end());
  return bytes;
}

Result<PlayableRun> decodedRun(std::span<const std::byte> bytes) {
  EncodedRun encoded;
  FieldReader reader(bytes, 0);
  codeRun(reader, encoded);
  std::vector<std::byte> told;
  reader.bytes(told);
  reader.end();
  if (!reader.fault().empty()) return Error{reader.fault()};
  if (encoded.magic != kRunBytesMagic) return Error{"does not begin as a run does"};
  if (!(encoded.deformationStep >= 0.0) || !std::isfinite(encoded.deformationStep))
    return Error{"has a step of deformations that is none"};
  Result<HostWorld> world = decodedWorld(encoded.world);
  if (!world) return world.error();
  if (world->bodies > kMostRunBodies) return Error{"has too many bodies"};
  PlayableRun run;
  run.world = *std::move(world);
  run.keepsOrder = encoded.keepsOrder;
  run.deformationStep = encoded.deformationStep;
  Result<std::vector<PlayableRun::Bodies>> bodies = decodedBodies(encoded.bodies, run.world.bodies);
  if (!bodies) return bodies.error();
  run.bodies = *std::move(bodies);
  Result<std::vector<RunPortion>> portions =
      decodedPortions(told, {.bodies = run.world.bodies, .points = 0});
  if (!portions) return portions.error();
  run.portions = *std::move(portions);
  return run;
}

Result<std::vector<std::byte>> encodedMore(const RunMore& more) {
  const Result<std::vector<EncodedBodies>> bodies = encodedBodies(more.bodies);
  if (!bodies) return bodies.error();
  const std::vector<std::byte> portions = encodedPortions(more.portions);
  std::vector<std::byte> bytes;
  FieldWriter writer(bytes);
  std::uint32_t magic = kMoreBytesMagic;
  writer.number(magic);
  codeBodies(writer, *bodies);
  writer.bytes(portions);
  return bytes;
}

Result<RunMore> decodedMore(std::span<const std::byte> bytes, std::uint32_t mostBodies) {
  FieldReader reader(bytes, 0);
  std::uint32_t magic = 0;
  std::vector<EncodedBodies> encoded;
  std::vector<std::byte> told;
  reader.number(magic);
  codeBodies(reader, encoded);
  reader.bytes(told);
  reader.end();
  if (!reader.fault().empty()) return Error{reader.fault()};
  if (magic != kMoreBytesMagic) return Error{"does not begin as what comes to a run does"};
  RunMore more;
  Result<std::vector<PlayableRun::Bodies>> bodies = decodedBodies(encoded, mostBodies);
  if (!bodies) return bodies.error();
  more.bodies = *std::move(bodies);
  Result<std::vector<RunPortion>> portions =
      decodedPortions(told, {.bodies = mostBodies, .points = 0});
  if (!portions) return portions.error();
  more.portions = *std::move(portions);
  return more;
}

}  // namespace carom::audio
