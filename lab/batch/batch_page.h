#pragma once

#include <string>
#include <string_view>

#include "lab/batch/batch_plan.h"
#include "lab/batch/batch_rows.h"

#include "carom/audio/result.h"

namespace carom::lab {

// The parts of the page of `carom batch report`, as they are in lab/batch/batch_page.
extern const std::string_view embedded_batch_html;
extern const std::string_view embedded_batch_js;

/// Returns a page about a batch: histograms of what was drawn and what came out, players of a
/// random dozen and of outliers, failures by kind. It refers to the sounds beside it, and to
/// nothing else. Of more than 20,000 rows it holds evenly spread ones.
std::string batchPage(const BatchPlan& plan, const BatchRows& rows);

/// Writes README.md, the data card, and read.py, which reads the samples, into the plan's folder.
Status writeDataCard(const BatchPlan& plan, const BatchRows& rows);

}  // namespace carom::lab
