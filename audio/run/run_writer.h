#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "audio/io/partial_file.h"
#include "audio/run/run_encoder.h"
#include "carom/audio/result.h"

namespace carom::audio {

/// Returns the 'p' of some portions as it stands in the file. Refuses more than kMostUnpacked
/// bytes, and everything in a build without Zstandard. [any thread]
Result<std::vector<std::byte>> packedPortions(std::span<const RunPortion> portions,
                                              Packing packing);

/// Writes a run (see RunEncoder) as it goes; memory does not grow with its length. The file appears
/// whole or not at all. [one thread]
class RunWriter {
 public:
  static Result<RunWriter> create(const std::filesystem::path& file, std::uint32_t version);

  /// Adds a portion; several are packed together.
  Status add(RunPortion portion);
  /// Adds another part, behind the portions so far.
  Status put(char kind, std::span<const std::byte> bytes);
  /// Adds a part that is packed already, with so many portions in it.
  Status putPacked(std::span<const std::byte> part, std::uint64_t portions);
  /// A place between two parts at which the file could end.
  struct Place {
    std::uintmax_t offset = 0;
    std::uint64_t portions = 0;  ///< before it
  };
  /// The end of what has been written.
  Place place() const { return {offset_, encoder_.packed()}; }
  /// True if the latest portions are not in the file yet.
  bool hasPending() const { return encoder_.hasPending(); }
  /// Drops what was written behind a place, or was to be written, after an error of the disk: that
  /// makes room for an end.
  Status goBackTo(const Place& place);
  /// Completes the file and gives it its name. Returns its size in bytes. To be called once.
  Result<std::uintmax_t> finish();

  const std::filesystem::path& file() const { return file_.finalPath(); }

 private:
  RunWriter(PartialFile file, std::shared_ptr<std::ofstream> stream, std::uint32_t version)
      : file_(std::move(file)), stream_(std::move(stream)), encoder_(version) {}
  Status write(const Status& encoded);
  Error cannotWrite() const;

  PartialFile file_;  // before the stream, which is closed first
  /// Shared with nobody, but a library without files has a mere name of its type, which this
  /// pointer allows.
  std::shared_ptr<std::ofstream> stream_;
  RunEncoder encoder_;
  std::uintmax_t offset_ = 0;  // bytes that the system has taken
};

}  // namespace carom::audio
