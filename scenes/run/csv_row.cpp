#include "scenes/run/csv_row.h"

#include <charconv>

namespace carom::scenes {

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
  if (text.find_first_of(",\"\r\n") == std::string::npos) {
    text_ += text;
    return *this;
  }
  text_ += '"';
  for (const char c : text)
    text_.append(c == '"' ? 2 : 1, c);
  text_ += '"';
  return *this;
}

}  // namespace carom::scenes
