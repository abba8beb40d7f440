#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string_view>
#include <vector>

#include "carom/native/recording.h"
#include "carom/native/recording_format.h"
#include "native/recording/recording_archive.h"

namespace {

constexpr std::size_t kChecksumSize = 8;

void require(bool promise) {
  if (!promise) std::abort();
}

/// Requires the properties of events that a renderer relies on without checking them again.
void requireSound(const carom::ImpulseEvent& event) {
  require(std::isfinite(event.time) && event.impulse.allFinite() && event.position.allFinite());
  require(event.normal.allFinite() && event.bodyPosition.allFinite());
  require(event.bodyVelocity.allFinite() && event.bodyOrientation.coeffs().allFinite());
  require(event.approachSpeed >= 0.0 && event.effectiveMass >= 0.0);
  require(event.radius >= 0.0 && event.otherRadius >= 0.0);
}

void play(const carom::Recording& recording) {
  require(recording.begin() <= recording.end());
  for (const double share : {0.0, 0.1, 0.5, 1.0}) {
    const double length = recording.end() - recording.begin();
    const double time = std::min(recording.begin() + share * length, recording.end());
    for (std::size_t sphere = 0; sphere < recording.sphereCount(); ++sphere) {
      const carom::SphereState state = recording.state(sphere, time);
      require(state.position.allFinite() && state.velocity.allFinite());
    }
  }
  double last = recording.begin();
  for (const carom::ImpulseEvent& event : recording.eventsBetween(-1.0, recording.end())) {
    require(event.time <= recording.end());
    requireSound(event);
  }
  for (const carom::Recording::Collision& collision : recording.collisions()) {
    require(collision.time.seconds >= last);
    last = collision.time.seconds;
  }
}

/// Requires that an accepted recording can be written and read again unchanged.
void rewrite(const carom::Recording& recording) {
  const auto bytes = carom::encoded(recording);
  require(static_cast<bool>(bytes));
  const auto again = carom::decoded(*bytes, "fuzz.carom");
  require(static_cast<bool>(again));
  require(again->trajectoryHash() == recording.trajectoryHash());
  require(again->payload() == recording.payload());
}

void read(std::span<const std::byte> bytes) {
  const auto recording = carom::decoded(bytes, "fuzz.carom");
  if (recording) {
    play(*recording);
    rewrite(*recording);
  } else {
    require(std::string_view(recording.error().message).starts_with("fuzz.carom: "));
  }
}

}  // namespace

/// Requires that any bytes, with a fitting checksum or without, give either a sound recording or an
/// error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto given = std::as_bytes(std::span(data, size));
  read(given);
  if (size < kChecksumSize) return 0;
  std::vector<std::byte> sealed(given.begin(), given.end() - kChecksumSize);
  const std::uint64_t checksum = carom::recordingChecksum(sealed);
  carom::native::ByteWriter(sealed).fixed(checksum, kChecksumSize);
  read(sealed);
  return 0;
}
