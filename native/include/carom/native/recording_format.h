#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include <carom/audio/result.h>
#include <carom/native/recording.h>

namespace carom {

/// The file format of a Recording. Little-endian on every platform:
///
///     8 bytes   "caromrec"
///     4 bytes   version, 1
///     ...       content
///     8 bytes   checksum of all bytes before: FNV-1a, which detects every change of a single byte
///
/// The content, in terms of
///
///     double    8 bytes, IEEE 754
///     count     7 bits in each byte, the lowest first, bit 7 set where more follow; a ninth byte
///               holds 8 bits
///     residual  a double, coded by its distance from one that the reader knows too: the number of
///               doubles between them, as a count, the sign in its lowest bit; 1 byte if equal
///     instant   residual of its seconds, double of the rest
///
/// is: begin, end (doubles), gravity (3 doubles); payload (count of bytes, bytes); spheres (count;
/// for each the count by which its id is above the least that it can be, residuals of radius and
/// mass against those of the sphere before, its first segment as instant and 9 doubles); walls
/// (count; for each its id as a count, normal, offset, velocity in 7 doubles); restitutions (count,
/// doubles); records (count), in the order in which things happened. A record is one byte of flags,
/// followed by the data that the flags leave open. The flags (bits):
///
///     a segment (bit 0 clear)              a collision (bit 0 set)
///     1  belongs to the last collision's   1  same instant as the record before
///        first body
///     2  belongs to its second body        2  instant follows from the two motions
///     3  same instant as the record        3  impact follows from the two states and the
///        before                               restitution whose number is given, a count
///     4  position follows                  4  both events follow (Recording::rebuilt)
///     5  velocity follows
///     6  acceleration unchanged
///     7  begins by meeting a body, too
///        slowly to be reported, at the
///        instant that follows from the two
///        motions
///
/// The data come in this order. First bodies, as counts: the sphere of a segment, unless bit 1 or 2
/// tells it; the body that a segment has met, if bit 7 is set; the first and the second body of a
/// collision (second: 0 for none, or one more than its number). Walls are numbered after the
/// spheres. A segment's meeting counts as the last collision, the met body as its second, for what
/// follows. Then an instant, against that of the record before, unless told by a bit. Then
/// residuals. Those of a segment: position, velocity (against what the sphere's segment before
/// comes to, or what the collision makes of it), acceleration (against that of the segment before).
/// Those of a collision: approach speed, effective mass, impulse, normal, against what follows from
/// the states with the first restitution; and for each of its two events, unless bit 4 is set, a
/// count whose bit k is set where field k of visitFields is given in residuals against the rebuilt
/// event, bit 13 for hasAppliedImpulse, bit 14 where the two ids are given as counts.
///
/// Everything said to follow is computed by recording_format.cpp with + - * / and sqrt alone, so it
/// has the same bits everywhere. A change of these computations, of contact_time.h among them,
/// needs a new version: RecordingFormat.GoldenBytes fails then.
///
/// `decoded` returns sound recordings only: instants in order, all numbers within kLargestRecorded,
/// all bodies known. Memory is at most some 100 times the number of bytes. [any thread]

inline constexpr std::uint32_t kRecordingVersion = 1;
inline constexpr std::string_view kRecordingMagic = "caromrec";
/// Largest absolute value of any coordinate, speed, acceleration or time, in SI units: the range of
/// SphereStepper.
inline constexpr double kLargestRecorded = 1e100;

/// Encodes a recording. Error only if one of its states is out of range.
Result<std::vector<std::byte>> encoded(const Recording& recording);

/// Decodes a recording. An error says what is wrong at which byte; `name` stands for the bytes in
/// messages.
Result<Recording> decoded(std::span<const std::byte> bytes, std::string_view name);

/// True if the bytes begin like a recording, even a damaged one.
bool looksLikeRecording(std::span<const std::byte> bytes);

/// The checksum that follows `bytes` as the last 8 bytes of a recording.
std::uint64_t recordingChecksum(std::span<const std::byte> bytes);

}  // namespace carom
