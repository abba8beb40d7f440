#include "lab/report/csv_cell.h"

#include <nlohmann/json.hpp>

namespace carom::lab {

std::string csvCell(const nlohmann::ordered_json& value) {
  if (value.is_null()) return {};
  return csvCell(value.is_string() ? value.get<std::string>() : value.dump());
}

}  // namespace carom::lab
