#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

namespace carom::lab {

/// Returns a text as a cell of a CSV file (RFC 4180).
std::string csvCell(const std::string& text);
/// Returns a value as a cell: null is empty, a text stands as it is, all else as in JSON.
std::string csvCell(const nlohmann::ordered_json& value);

}  // namespace carom::lab
