#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "lab/batch/batch_spec.h"

#include "carom/audio/result.h"

namespace carom::lab {

/// A batch whose every sample is settled, and the folder that holds it: what `carom batch plan`
/// makes. It holds the scenes and the lists of files as they were then; the files that scenes name
/// stay where they are.
struct BatchPlan {
  std::filesystem::path folder;
  BatchSpec spec;
  /// Documents of the scenes by the names that the batch has for them.
  std::map<std::string, nlohmann::json> scenes;
  nlohmann::json document;     ///< the batch, with lists of files in place of patterns
  std::filesystem::path home;  ///< folder of the batch file, which names of scenes are relative to
  std::string hash;            ///< SHA-256 of all that samples depend on; not of their number
};

/// Reads a batch file and its scenes. `count` replaces the number of samples. Errors: those of
/// parseBatch, a scene that cannot be read, a pointer that names no place in it. [any thread]
Result<BatchPlan> makePlan(const std::filesystem::path& batchFile,
                           const std::filesystem::path& folder, std::optional<std::uint64_t> count);

/// Writes a plan into its folder, which is made if it is not there. Where a plan is already, only
/// the number of samples may differ; where none is, nothing may have a name that a batch writes
/// anew. [any thread]
Status savePlan(const BatchPlan& plan);

/// Reads the plan of a folder. [any thread]
Result<BatchPlan> loadPlan(const std::filesystem::path& folder);

/// Returns the path of a sample's file relative to the plan's folder, such as
/// "samples/0012/001234.wood.wav": 100 samples in a folder.
std::string sampleFile(std::uint64_t index, const std::string& branch, const std::string& ending);

}  // namespace carom::lab
