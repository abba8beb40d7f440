#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "audio/run/run_portion.h"
#include "audio/run/zstd_frame.h"
#include "carom/audio/result.h"

namespace carom::audio {

/// The file of a run on any stepper, or of a host's: all that the mechanics has told, to be heard
/// again without it. Little-endian:
///
///     8 bytes   "caromrun"
///     4 bytes   version: 3 of a scene's run, 4 of a host's; 1 and 2 were told another way
///     parts, each
///         1 byte    its kind
///         4 bytes   number of bytes that are stored
///         4 bytes   number of bytes when they are unpacked, at most 2^28
///         8 bytes   checksum of the stored bytes, FNV-1a
///         ...       the bytes, packed by Zstandard (RFC 8878)
///
/// The parts of a scene's run: one 'h' (scenes/recording/run_header.h), any number of 'p', each
/// portions as encodedPortions says, and 'e'. Those of a host's run: 'b' and 'p' as they come, a
/// 'b' being bodies as HostEncoder has them, from the portions behind it on; 'w', as encodedWorld
/// says, behind an 'l' for each piece of a path that is too long for it (encodedPath); and 'e'. In
/// 'e' is a JSON object with the number of portions. A file that was cut has no end, and is refused
/// there.
inline constexpr std::string_view kRunMagic = "caromrun";
inline constexpr std::size_t kMostUnpacked = std::size_t{1} << 28U;  ///< bytes of a part
inline constexpr std::uint32_t kSceneRun = 3;                        ///< versions
inline constexpr std::uint32_t kHostRun = 4;
/// Most bodies of a run.
inline constexpr std::uint32_t kMostRunBodies = 200'000;

/// Returns a part as it stands in the file. Refuses more than kMostUnpacked bytes. [any thread]
Result<std::vector<std::byte>> packedPart(char kind, std::span<const std::byte> bytes,
                                          Packing packing = Packing::small);
/// Returns about how much memory a portion takes. [any thread]
std::size_t sizeOf(const RunPortion& portion);

/// Makes the bytes of such a file as the run goes; RunWriter writes them. [one thread]
class RunEncoder {
 public:
  explicit RunEncoder(std::uint32_t version);

  /// Adds a portion; several are packed together.
  Status add(RunPortion portion);
  /// Adds another part, behind the portions so far.
  Status put(char kind, std::span<const std::byte> bytes);
  /// Adds a part that is packed already, with so many portions in it.
  Status putPacked(std::span<const std::byte> part, std::uint64_t portions);
  /// Adds the end. To be called once.
  Status finish();

  /// Portions in the parts so far: those that were added since are not packed yet.
  std::uint64_t packed() const { return packed_; }
  bool hasPending() const { return !portions_.empty(); }
  /// Drops what is not packed, and counts anew from there: the file was cut.
  void goBackTo(std::uint64_t packed);

  /// Returns the bytes that came to be since the last call.
  std::vector<std::byte> take();

 private:
  Status flush();
  Status append(const Result<std::vector<std::byte>>& part);

  std::vector<std::byte> bytes_;
  std::vector<RunPortion> portions_;  // not packed yet
  std::size_t pending_ = 0;           // bytes of these, about
  std::uint64_t packed_ = 0;          // portions
};

}  // namespace carom::audio
