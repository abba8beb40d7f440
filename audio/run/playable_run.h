#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "audio/run/host_run.h"
#include "audio/run/run_portion.h"
#include "carom/audio/result.h"

namespace carom::audio {

/// A run in memory, of a scene or of a host, with all that its sound needs.
struct PlayableRun {
  /// Bodies, from a portion on.
  struct Bodies {
    std::uint64_t portion = 0;  ///< index of the first portion that is heard with them
    std::vector<HostBody> bodies;
  };

  HostWorld world;             ///< `begin` is 0: the times of all portions are those of the sound
  std::vector<Bodies> bodies;  ///< in order of their portions
  std::vector<RunPortion> portions;  ///< without pictures
  bool keepsOrder = false;           ///< events are heard in the order in which they stand
  double deformationStep = 0.0;      ///< s, between states of what deforms; 0: nothing does
};

/// A place of an event in a run.
struct EventPlace {
  std::size_t portion = 0;
  std::size_t event = 0;  ///< index in the portion
};

/// Returns the places of all events up to the run's duration, in order of time; those of one time
/// in the order in which they stand. [any thread]
std::vector<EventPlace> eventsInOrder(const PlayableRun& run);

/// Returns a run as bytes without compression: for a player that has no file, such as a page.
/// Refuses a model that cannot be encoded. [any thread]
Result<std::vector<std::byte>> encodedRun(const PlayableRun& run);
/// The bytes of encodedRun in two parts, one after the other.
struct EncodedRunParts {
  std::vector<std::byte> sound;     ///< the world, and how its bodies sound
  std::vector<std::byte> portions;  ///< the same for all sounds of the same mechanics
};
/// Returns them. Refuses a model that cannot be encoded. [any thread]
Result<EncodedRunParts> encodedRunParts(const PlayableRun& run);

/// Returns the run of such bytes. An error, the second half of a sentence, is that of bytes which
/// no run has. Never throws for bad input but for lack of memory. [any thread]
Result<PlayableRun> decodedRun(std::span<const std::byte> bytes);

/// Bodies and portions that come to a run that goes on.
struct RunMore {
  std::vector<PlayableRun::Bodies> bodies;  ///< by the indices that portions will have
  std::vector<RunPortion> portions;         ///< without pictures
};
/// Returns it as bytes, and what such bytes are, as encodedRun and decodedRun do. A body that is
/// not one of `mostBodies` is refused. [any thread]
Result<std::vector<std::byte>> encodedMore(const RunMore& more);
Result<RunMore> decodedMore(std::span<const std::byte> bytes, std::uint32_t mostBodies);

}  // namespace carom::audio
