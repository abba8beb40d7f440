#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "lab/batch/batch_plan.h"
#include "lab/batch/batch_rows.h"

#include "carom/audio/result.h"

namespace carom::lab {

/// Returns the hash of all sounds and events of a batch: SHA-256 of the hashes of its files in the
/// order of samples and branches, whoever made them and when.
std::string contentHash(const BatchRows& rows);

/// Writes manifest.jsonl, manifest.csv and failures.jsonl into the plan's folder, each whole or not
/// at all, in the order of samples and branches. [any thread]
Status writeManifest(const BatchPlan& plan, const BatchRows& rows);

/// The findings of `carom batch verify`: branches of samples, by their files.
struct BatchCheck {
  std::uint64_t whole = 0;
  std::uint64_t missing = 0;          ///< no row, no file, or failed
  std::uint64_t damaged = 0;          ///< a file with another hash than its row
  std::vector<std::string> faults;    ///< the first of those that are missing or damaged
  std::vector<std::string> machines;  ///< kinds of machines and versions that rows were made on
  std::string contentHash;            ///< of what is whole
};

/// Hashes every file again, and writes the manifest anew. [any thread]
Result<BatchCheck> verifyBatch(const BatchPlan& plan);

}  // namespace carom::lab
