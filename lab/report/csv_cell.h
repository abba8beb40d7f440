#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "scenes/rows/csv_row.h"

namespace carom::lab {

using scenes::csvCell;

/// Returns a value as a cell: null is empty, a text stands as it is, all else as in JSON.
std::string csvCell(const nlohmann::ordered_json& value);

}  // namespace carom::lab
