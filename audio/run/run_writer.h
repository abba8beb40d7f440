#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "audio/io/partial_file.h"
#include "audio/run/run_portion.h"
#include "carom/audio/result.h"

namespace carom::audio {

/// The file of a run on any stepper, or of a host's: all that the mechanics has told, to be heard
/// again without it. Little-endian:
///
///     8 bytes   "caromrun"
///     4 bytes   version: 1 of a scene's run, 2 of a host's
///     parts, each
///         1 byte    its kind
///         4 bytes   number of bytes that are stored
///         4 bytes   number of bytes when they are unpacked, at most 2^28
///         8 bytes   checksum of the stored bytes, FNV-1a
///         ...       the bytes, packed by Zstandard (RFC 8878)
///
/// The parts of a scene's run: one 'h' (scenes/recording/run_file.h), any number of 'p', each
/// portions as encodedPortions says, and 'e'. Those of a host's run: 'b' and 'p' as they come, a
/// 'b' being bodies as HostEncoder has them, from the portions behind it on; 'w', as encodedWorld
/// says; and 'e'. In 'e' is a JSON object with the number of portions. A file that was cut has no
/// end, and is refused there.
inline constexpr std::string_view kRunMagic = "caromrun";
inline constexpr std::size_t kMostUnpacked = std::size_t{1} << 28U;  ///< bytes of a part
inline constexpr std::uint32_t kSceneRun = 1;                        ///< versions
inline constexpr std::uint32_t kHostRun = 2;
/// Most bodies of a run.
inline constexpr std::uint32_t kMostRunBodies = 200'000;

/// The time that packing may take.
enum class Packing : std::uint8_t {
  small,  ///< for files that are kept
  quick,  ///< a quarter of the time, for what mostly is thrown away
};

/// Returns the 'p' of some portions as it stands in the file. Refuses more than kMostUnpacked
/// bytes, and everything in a build without Zstandard. [any thread]
Result<std::vector<std::byte>> packedPortions(std::span<const RunPortion> portions,
                                              Packing packing);
/// Returns about how much memory a portion takes. [any thread]
std::size_t sizeOf(const RunPortion& portion);

/// Writes a run as it goes; memory does not grow with its length. The file appears whole or not at
/// all. [one thread]
class RunWriter {
 public:
  static Result<RunWriter> create(const std::filesystem::path& file, std::uint32_t version);

  /// Adds a portion; several are packed together.
  Status add(RunPortion portion);
  /// Adds another part, behind the portions so far.
  Status put(char kind, std::span<const std::byte> bytes);
  /// Adds a part that is packed already, with so many portions in it.
  Status putPacked(std::span<const std::byte> part, std::uint64_t portions);
  /// Completes the file and gives it its name. Returns its size in bytes. To be called once.
  Result<std::uintmax_t> finish();

  const std::filesystem::path& file() const { return file_.finalPath(); }

 private:
  RunWriter(PartialFile file, std::shared_ptr<std::ofstream> stream)
      : file_(std::move(file)), stream_(std::move(stream)) {}
  Status flush();
  Status writeBytes(std::span<const std::byte> bytes);
  Error cannotWrite() const;

  PartialFile file_;  // before the stream, which is closed first
  /// Shared with nobody, but a library without files has a mere name of its type, which this
  /// pointer allows.
  std::shared_ptr<std::ofstream> stream_;
  std::vector<RunPortion> portions_;  // not written yet
  std::size_t pending_ = 0;           // bytes of these, about
  std::uint64_t written_ = 0;         // portions
};

}  // namespace carom::audio
