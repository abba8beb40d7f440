#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "lab/batch/batch_spec.h"
#include <nlohmann/json.hpp>

#include "carom/audio/result.h"

namespace carom::lab {

/// The values of all parameters of a sample, in the order of the batch.
using SampleValues = std::vector<std::pair<std::string, nlohmann::json>>;

/// Draws the values of a sample. They depend on the batch's seed, the index, the attempt and each
/// parameter's name and description, and on nothing else: not on the number of samples, nor on
/// other parameters. Of the grids the first one varies slowest, so values that are added to its end
/// add samples at the end; where there are more samples than points, the grids begin anew. An error
/// is that of an expression. [any thread]
Result<SampleValues> drawValues(const BatchSpec& spec, std::uint64_t index, std::size_t attempt);

/// True if the expression of `reject_if` is other than 0 for these values. [any thread]
Result<bool> isRejected(const BatchSpec& spec, const SampleValues& values);

/// Returns a scene's document with the values of a sample in their places, the listeners of the
/// batch, and what the branch sets. An error says which pointer names no place. [any thread]
Result<nlohmann::json> applied(const BatchSpec& spec, const SampleValues& values,
                               const BatchBranch& branch, nlohmann::json scene);

/// Returns the name of the scene file of a sample.
const std::string& sceneOf(const BatchSpec& spec, const SampleValues& values);

/// Returns "train", "validation" or "test". [any thread]
std::string splitOf(const BatchSpec& spec, std::uint64_t index, const SampleValues& values);

}  // namespace carom::lab
