#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "lab/batch/batch_plan.h"
#include "lab/batch/batch_rows.h"

#include "carom/audio/result.h"

namespace carom::lab {

/// Packs all files of whole samples into tar files of at most `samples` samples each, by GNU tar,
/// as WebDataset reads them: shards/SPLIT-000000.tar, in which the files of a sample follow each
/// other and share the part of their names before the first dot. The same batch gives the same
/// bytes. Returns the names of the files. [one thread]
Result<std::vector<std::string>> packBatch(const BatchPlan& plan, const BatchRows& rows,
                                           std::uint64_t samples);

}  // namespace carom::lab
