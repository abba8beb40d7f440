#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "lab/batch/batch_plan.h"
#include <nlohmann/json.hpp>

#include "carom/audio/result.h"

namespace carom::lab {

/// A sample and the name of its branch; empty where there is one only.
using BranchId = std::pair<std::uint64_t, std::string>;

/// The keys that a row has for one of its files; it need not have all files.
struct RowFile {
  const char* name;
  const char* bytes;
  const char* hash;
};
inline constexpr std::array<RowFile, 7> kRowFiles = {
    {{"file", "bytes", "sha256"},
     {"events_file", "events_bytes", "events_sha256"},
     {"contacts_file", "contacts_bytes", "contacts_sha256"},
     {"poses_file", "poses_bytes", "poses_sha256"},
     {"clicks_file", "clicks_bytes", "clicks_sha256"},
     {"rings_file", "rings_bytes", "rings_sha256"},
     {"contacts_sound_file", "contacts_sound_bytes", "contacts_sound_sha256"}}};
/// Index in kRowFiles of the first Stem.
inline constexpr std::size_t kStemFiles = 4;

/// All that the runs of a batch have told so far: rows of branches that are whole, and failures of
/// those that have failed and were not made later. A failure of a whole sample has an empty branch.
struct BatchRows {
  std::map<BranchId, nlohmann::ordered_json> rows;
  std::map<BranchId, nlohmann::ordered_json> failures;
};

/// Returns what the row's files were made on: version, instruction set and C library.
std::string machineOf(const nlohmann::ordered_json& row);

/// Reads what all runs have told. Lines that a run was killed in are left out, and so is what no
/// run of this plan writes: other branches, names of files elsewhere. [any thread]
Result<BatchRows> readRows(const BatchPlan& plan);

/// How a sample is found to be done.
struct DoneRules {
  bool failuresCount = true;  ///< a branch that failed is done
  bool hashes = false;        ///< hashes every file, instead of looking at its size
};

/// Returns for each sample below the plan's count true if it has nothing more to do: each branch
/// has a row and its files, or has failed. [any thread]
std::vector<bool> doneSamples(const BatchPlan& plan, const BatchRows& rows, const DoneRules& rules);

/// The file into which one run tells of its samples, line by line: nobody else writes it, so runs
/// on many machines share a folder without locks. [one thread]
class RowLog {
 public:
  /// Creates a file of a name that no other run has.
  static Result<RowLog> create(const BatchPlan& plan);

  /// Adds a line, which is the system's when this returns.
  Status add(const nlohmann::ordered_json& line);

 private:
  RowLog(std::filesystem::path path, std::ofstream stream)
      : path_(std::move(path)), stream_(std::move(stream)) {}

  std::filesystem::path path_;
  std::ofstream stream_;
};

}  // namespace carom::lab
