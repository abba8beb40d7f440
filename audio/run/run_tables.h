#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "audio/run/run_portion.h"
#include "carom/audio/result.h"

namespace carom::audio {

/// The sizes that a run's numbers are read with.
struct RunShape {
  std::uint32_t bodies = 0;  ///< of the scene
  std::uint32_t points = 0;  ///< of its jello; 0 if there is none
};

/// Returns portions of a tape as bytes that compress well: a table for portions, events, contacts,
/// poses, states of what deforms and pictures each, column by column, each number as its difference
/// in bits from the one above, and of these first all lowest bytes, then the next. What is above a
/// step of a contact is the latest step of the same two bodies, and above a pose the latest of the
/// same body, if there is one. Reading them back gives the same bits. [any thread]
std::vector<std::byte> encodedPortions(std::span<const RunPortion> portions);

/// Returns the portions of such bytes. An error, the second half of a sentence, is that of bytes
/// which no run has: too few or too many, a body that is not there, a number that is none, an
/// orientation that is not of unit length. Never throws for bad input but for lack of memory, of
/// which it takes at most some ten times as much as there are bytes. [any thread]
Result<std::vector<RunPortion>> decodedPortions(std::span<const std::byte> bytes,
                                                const RunShape& shape);

/// True for what decodedPortions reads again: a record whose numbers are numbers, of at most 1e100,
/// and whose orientations are of unit length, within 1e-3. [any thread]
bool isReadable(const ImpulseEvent& event);
bool isReadable(const ContactState& contact);
bool isReadable(const BodyPose& pose);

}  // namespace carom::audio
