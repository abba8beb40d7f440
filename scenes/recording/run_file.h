#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <istream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "audio/run/host_run.h"
#include "audio/run/run_portion.h"
#include "audio/run/run_writer.h"
#include "carom/audio/result.h"
#include "scenes/recording/run_header.h"

namespace carom::scenes {

/// Begins the file of a scene's run.
Result<audio::RunWriter> beginRun(const std::filesystem::path& file, const RunHeader& header);

/// The bodies and settings of a host's run.
struct HostRun {
  audio::HostWorld world;
  /// In order: the first with an id is how the run begins, another one how it goes on.
  std::vector<audio::HostBody> bodies;
};

/// Reads a run from its beginning to its end; see RunWriter for the file. Never throws for bad
/// input but for lack of memory. [one thread]
class RunReader {
 public:
  static Result<RunReader> open(const std::filesystem::path& file);
  /// Reads a run from anywhere that can be sought in; `name` stands for it in messages.
  static Result<RunReader> read(std::unique_ptr<std::istream> stream, std::string name);

  const RunHeader& header() const { return header_; }
  /// A host's run; null for a scene's.
  const HostRun* host() const { return host_ ? &*host_ : nullptr; }
  /// Reads the next portions; none at the end. An error names file and part.
  Result<std::vector<audio::RunPortion>> next();
  /// Returns, as indices of HostRun::bodies, those that are others from the portions on that `next`
  /// has returned last.
  const std::vector<std::size_t>& changes() const { return changes_; }

 private:
  /// The numbers that stand before the bytes of a part.
  struct PartHead {
    char kind = 'e';
    std::uint32_t stored = 0;
    std::uint32_t unpacked = 0;
    std::uint64_t checksum = 0;
  };
  struct Part {
    char kind = 'e';
    std::vector<std::byte> bytes;
  };
  RunReader(std::string name, std::unique_ptr<std::istream> stream)
      : name_(std::move(name)), stream_(std::move(stream)) {}
  Result<PartHead> takeHead();
  Result<Part> takeBody(const PartHead& head);
  Result<Part> take();
  Status readHeader();
  Status checkWhole();
  Status readHost();
  Status readHostParts();
  Status checkBodies() const;
  void noteBodies();
  Result<std::vector<audio::RunPortion>> end(const std::vector<std::byte>& bytes);
  void shift(std::vector<audio::RunPortion>& portions) const;
  Error fault(const std::string& what) const;

  std::string name_;
  std::unique_ptr<std::istream> stream_;
  RunHeader header_;
  std::optional<HostRun> host_;
  std::vector<std::size_t> counts_;  // of bodies in each 'b' of a host's run
  std::size_t count_ = 0;            // of these, the next one
  std::size_t body_ = 0;             // in HostRun::bodies, the next one
  std::vector<bool> isKnown_;        // by id: the body has come up to here
  std::vector<std::size_t> changes_;
  std::uint64_t parts_ = 0;
  std::uint64_t portions_ = 0;
  bool ended_ = false;
};

/// True if the file begins as a run file does.
bool isRunFile(const std::filesystem::path& file);

}  // namespace carom::scenes
