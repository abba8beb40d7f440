#pragma once

#include <string>

#include "carom/audio/vector.h"

namespace carom::scenes {

/// Returns a text as a cell of a CSV file (RFC 4180). [any thread]
std::string csvCell(const std::string& text);

/// A row of a CSV file (RFC 4180), cell by cell. Numbers have all their digits: reading them back
/// gives the same bits. [one thread]
class CsvRow {
 public:
  CsvRow& add(double value);
  CsvRow& add(const Vec3& v);  ///< three cells
  CsvRow& add(const std::string& text);

  /// Returns the row with its line end.
  std::string line() const { return text_ + '\n'; }

 private:
  void separate();

  std::string text_;
  bool isEmpty_ = true;
};

}  // namespace carom::scenes
