#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include <carom/audio/result.h>
#include <carom/native/recording.h>

namespace carom {

/// The form of a Recording for files. Little-endian on every platform:
///
///     8 bytes   "caromrec"
///     4 bytes   version, 1
///     ...       content
///     8 bytes   checksum of all before: FNV-1a, which no change of a single byte escapes
///
/// The content, in terms of
///
///     double    8 bytes, IEEE 754
///     count     7 bits in each byte, the lowest first, bit 7 set where more follow; a ninth byte
///               holds 8 bits
///     residual  of a double, against one that the reader knows too: how many doubles lie between
///               them, as a count, the sign in its lowest bit; so 1 byte where they are equal
///     instant   residual of its seconds, double of the rest
///
/// is: begin, end (doubles), gravity (3 doubles); payload (count of bytes, bytes); spheres (count;
/// for each the count by which its id is above the least that it can be, residuals of radius and
/// mass against those of the sphere before, its first segment as instant and 9 doubles); walls
/// (count; for each its id as a count, normal, offset, velocity in 7 doubles); restitutions (count,
/// doubles); records (count), in the order in which things happened. A record is one byte of flags,
/// and what they leave open.
///
///     a segment (bit 0 clear)              a collision (bit 0 set)
///     1  is of the last collision's first  1  at the instant of the record before
///     2  is of its second                  2  at the instant that follows from the two motions
///     3  at the instant of the record      3  as follows from the two states and the restitution
///        before                               whose number follows, a count
///     4  position as follows               4  nothing but what is rebuilt
///     5  velocity as follows
///     6  acceleration as before
///     7  has met a body, too slowly to be
///        reported, when that follows from
///        the two motions
///
/// In this order: bodies, as counts, unless told by the bits 1 and 2 of a segment (a collision's
/// second: 0 for none, or one more than its number; walls come after the spheres; whom a segment
/// has met, which then is as the second of a collision); an instant, against that of the record
/// before, unless told by a bit; then residuals. Of a segment: position, velocity (against what the
/// sphere's segment before comes to, or what the collision makes of it), acceleration (against that
/// of the segment before). Of a collision: approach speed, effective mass, impulse, normal, against
/// what follows from the states with the first restitution; and of each of its two events, if there
/// is more, a count whose bit k is set where field k of visitFields follows in residuals against
/// what is rebuilt, bit 13 for hasAppliedImpulse, bit 14 where the two ids follow as counts.
///
/// What follows is computed by recording_format.cpp with + - * / and sqrt alone, so it has the same
/// bits everywhere. A change of these computations, of contact_time.h among them, needs a new
/// version: RecordingFormat.GoldenBytes fails then.
///
/// Nothing but a sound recording comes out of `decoded`: instants in order, all numbers within
/// kLargestRecorded, all bodies known. Memory is at most some 100 times the number of bytes. [any
/// thread]

inline constexpr std::uint32_t kRecordingVersion = 1;
inline constexpr std::string_view kRecordingMagic = "caromrec";
/// Of any coordinate, speed, acceleration or time, in SI units: the range of SphereStepper.
inline constexpr double kLargestRecorded = 1e100;

/// Refuses a recording whose states are out of range, and nothing else.
Result<std::vector<std::byte>> encoded(const Recording& recording);

/// An error says what is wrong at which byte; `name` stands for the bytes in messages.
Result<Recording> decoded(std::span<const std::byte> bytes, std::string_view name);

/// Whether these are, or once were, a recording.
bool looksLikeRecording(std::span<const std::byte> bytes);

/// The last 8 bytes of a recording that has `bytes` before them.
std::uint64_t recordingChecksum(std::span<const std::byte> bytes);

}  // namespace carom
