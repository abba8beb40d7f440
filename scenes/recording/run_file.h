#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <istream>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "audio/io/partial_file.h"
#include "carom/audio/result.h"
#include "scenes/recording/event_tape.h"
#include "scenes/recording/run_tables.h"

namespace carom::scenes {

/// The beginning of a run file.
struct RunHeader {
  std::string sceneFile;         ///< its name, which files that the scene names are relative to
  std::string sceneText;         ///< JSON
  std::string stepper;           ///< "native" or "bullet"
  double duration = 0.0;         ///< s, > 0
  double deformationStep = 0.0;  ///< s, see SceneStepper::hearDeformations; 0: nothing deforms
  RunShape shape;
};

/// The file of a run on any stepper: all that a stepper has told, to be heard again without it.
/// Little-endian:
///
///     8 bytes   "caromrun"
///     4 bytes   version, 1
///     parts     the header first, then portions of the run, the end last; each
///         1 byte    'h', 'p' or 'e'
///         4 bytes   number of bytes that are stored
///         4 bytes   number of bytes when they are unpacked, at most 2^28
///         8 bytes   checksum of the stored bytes, FNV-1a
///         ...       the bytes, packed by Zstandard (RFC 8878)
///
/// The header is a JSON object, the end a JSON object with the number of portions; portions are as
/// encodedPortions says. A file that was cut has no end, and is refused there.

/// Writes a run as it goes; memory does not grow with its length. The file appears whole or not at
/// all. [one thread]
class RunWriter {
 public:
  static Result<RunWriter> create(const std::filesystem::path& file, const RunHeader& header);

  Status add(TapePortion portion);
  /// Completes the file and gives it its name. Returns its size in bytes. To be called once.
  Result<std::uintmax_t> finish();

 private:
  RunWriter(audio::PartialFile file, std::ofstream stream, const RunShape& shape)
      : file_(std::move(file)), stream_(std::move(stream)), shape_(shape) {}
  Status flush();
  Status put(char kind, std::span<const std::byte> bytes);

  audio::PartialFile file_;  // before the stream, which is closed first
  std::ofstream stream_;
  RunShape shape_;
  std::vector<TapePortion> portions_;  // not written yet
  std::size_t pending_ = 0;            // bytes of these, about
  std::uint64_t written_ = 0;          // portions
};

/// Reads a run from its beginning to its end. Never throws for bad input but for lack of memory.
/// [one thread]
class RunReader {
 public:
  static Result<RunReader> open(const std::filesystem::path& file);
  /// Reads a run from anywhere; `name` stands for it in messages.
  static Result<RunReader> read(std::unique_ptr<std::istream> stream, std::string name);

  const RunHeader& header() const { return header_; }
  /// Reads the next portions; none at the end. An error names file and part.
  Result<std::vector<TapePortion>> next();

 private:
  struct Part {
    char kind = 'e';
    std::vector<std::byte> bytes;
  };
  RunReader(std::string name, std::unique_ptr<std::istream> stream)
      : name_(std::move(name)), stream_(std::move(stream)) {}
  Result<Part> take();
  Status readHeader();
  Error fault(const std::string& what) const;

  std::string name_;
  std::unique_ptr<std::istream> stream_;
  RunHeader header_;
  std::uint64_t parts_ = 0;
  std::uint64_t portions_ = 0;
  bool ended_ = false;
};

/// True if the file begins as a run file does.
bool isRunFile(const std::filesystem::path& file);

}  // namespace carom::scenes
