#include "scenes/rows/csv_row.h"

#include <charconv>

namespace carom::scenes {

std::string csvCell(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string cell = "\"";
  for (const char c : text)
    cell.append(c == '"' ? 2 : 1, c);
  return cell + '"';
}

void CsvRow::separate() {
  if (!isEmpty_) text_ += ',';
  isEmpty_ = false;
}

CsvRow& CsvRow::add(double value) {
  separate();
  char text[32];
  const auto [end, error] = std::to_chars(std::begin(text), std::end(text), value);
  text_.append(text, end);
  return *this;
}

CsvRow& CsvRow::add(const Vec3& v) {
  return add(v[0]).add(v[1]).add(v[2]);
}

CsvRow& CsvRow::add(const std::string& text) {
  separate();
  text_ += csvCell(text);
  return *this;
}

}  // namespace carom::scenes
