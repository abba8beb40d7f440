#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "audio/model/decimal.h"

namespace carom::test {

/// Parses RFC 4180: fields between commas, rows between line feeds. A field in quotation marks may
/// hold either, and a quotation mark as two.
inline std::vector<std::vector<std::string>> parseCsv(std::string_view text) {
  std::vector<std::vector<std::string>> rows;
  std::vector<std::string> row;
  std::string field;
  bool quoted = false;
  for (std::size_t at = 0; at < text.size(); ++at) {
    const char c = text[at];
    const bool doubled = quoted && c == '"' && at + 1 < text.size() && text[at + 1] == '"';
    if (doubled) {
      field += text[++at];
    } else if (c == '"') {
      quoted = !quoted;
    } else if (!quoted && (c == ',' || c == '\n')) {
      row.push_back(std::move(field));
      field.clear();
      if (c == ',') continue;
      rows.push_back(std::move(row));
      row.clear();
    } else {
      field += c;
    }
  }
  EXPECT_TRUE(!quoted && field.empty() && row.empty()) << "the last row has no end";
  return rows;
}

/// Value of a field that must be a number and nothing else.
inline double numberOf(const std::string& field) {
  double value = 0.0;
  const auto [end, error] = audio::readDecimal(field.data(), field.data() + field.size(), value);
  EXPECT_TRUE(error == std::errc() && end == field.data() + field.size()) << '"' << field << '"';
  return value;
}

}  // namespace carom::test
