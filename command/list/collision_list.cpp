#include "command/list/collision_list.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "audio/model/decimal.h"
#include "modal/json/json_reader.h"

namespace carom::command {
namespace {

constexpr std::array<std::string_view, 12> kColumns = {"time_s", "body",      "other",   "jx_Ns",
                                                       "jy_Ns",  "jz_Ns",     "px_m",    "py_m",
                                                       "pz_m",   "collision", "peak_pa", "heard"};
constexpr std::string_view kSpeed = "approach_speed_m_s";

/// Reads a CSV file (RFC 4180) row by row.
class CsvText {
 public:
  explicit CsvText(std::string_view text) : text_(text) {}

  bool isOver() const { return at_ >= text_.size(); }
  std::size_t line() const { return line_; }

  /// Reads the next row; false if a quotation mark of it is never closed.
  bool read(std::vector<std::string>& cells) {
    cells.assign(1, {});
    ++line_;
    while (at_ < text_.size()) {
      const char letter = text_[at_++];
      if (letter == '\n') break;
      if (letter == ',') {
        cells.emplace_back();
      } else if (letter == '"' && cells.back().empty()) {
        if (!readQuoted(cells.back())) return false;
      } else if (letter != '\r') {
        cells.back() += letter;
      }
    }
    return true;
  }

 private:
  bool readQuoted(std::string& cell) {
    while (at_ < text_.size()) {
      const char letter = text_[at_++];
      if (letter == '\n') ++line_;
      const bool isDoubled = letter == '"' && at_ < text_.size() && text_[at_] == '"';
      if (letter == '"' && !isDoubled) return true;
      if (isDoubled) ++at_;
      cell += letter;
    }
    return false;
  }

  std::string_view text_;
  std::size_t at_ = 0;
  std::size_t line_ = 0;
};

/// A row of an events file, by the names of its columns; keeps the first error.
class EventCells {
 public:
  EventCells(const std::map<std::string, std::size_t, std::less<>>& columns,
             const std::vector<std::string>& cells)
      : columns_(columns), cells_(cells) {}

  const std::string& word(std::string_view column) const {
    return cells_[columns_.find(column)->second];
  }
  double number(std::string_view column) {
    const std::string& text = word(column);
    double value = 0.0;
    const auto read = audio::readDecimal(text.data(), text.data() + text.size(), value);
    if (read.ec == std::errc() && read.ptr == text.data() + text.size() && std::isfinite(value))
      return value;
    if (error_.empty())
      error_ = "column " + std::string(column) + " holds " + modal::inQuotes(text) +
               "; expected a number";
    return 0.0;
  }
  Vec3 vector(std::string_view x, std::string_view y, std::string_view z) {
    return Vec3{number(x), number(y), number(z)};
  }
  const std::string& error() const { return error_; }

 private:
  const std::map<std::string, std::size_t, std::less<>>& columns_;
  const std::vector<std::string>& cells_;
  std::string error_;
};

ListedCollision collisionOf(EventCells& row) {
  ListedCollision collision;
  const double number = row.number("collision");
  if (number >= 1.0 && number <= 1e15) collision.number = static_cast<std::uint64_t>(number);
  collision.time = row.number("time_s");
  collision.body = row.word("body");
  collision.other = row.word("other");
  collision.impulse = row.vector("jx_Ns", "jy_Ns", "jz_Ns").norm();
  collision.position = row.vector("px_m", "py_m", "pz_m");
  collision.approachSpeed = row.number(kSpeed);
  collision.peak = row.number("peak_pa");
  collision.isHeard = row.word("heard") == "1";
  return collision;
}

}  // namespace

Result<std::vector<ListedCollision>> readCollisions(std::string_view text,
                                                    const std::string& name) {
  CsvText csv(text);
  const auto fault = [&](const std::string& what) {
    return Error{name + ": line " + std::to_string(csv.line()) + ": " + what};
  };
  std::vector<std::string> cells;
  std::map<std::string, std::size_t, std::less<>> columns;
  if (!csv.read(cells)) return fault("a quotation mark is never closed");
  const std::size_t width = cells.size();
  for (std::size_t column = 0; column < width; ++column)
    columns.emplace(cells[column], column);
  std::vector<std::string_view> needed(kColumns.begin(), kColumns.end());
  needed.push_back(kSpeed);
  for (const std::string_view column : needed)
    if (!columns.contains(column))
      return fault("there is no column " + std::string(column) +
                   "; expected a file of 'carom render --events'");
  std::vector<ListedCollision> collisions;
  std::map<std::uint64_t, std::size_t> places;  // by number
  while (!csv.isOver()) {
    if (!csv.read(cells)) return fault("a quotation mark is never closed");
    if (cells.size() != width)
      return fault(std::to_string(cells.size()) + " cells; expected " + std::to_string(width));
    EventCells row(columns, cells);
    ListedCollision collision = collisionOf(row);
    if (!row.error().empty()) return fault(row.error());
    if (collision.number == 0) return fault("column collision: expected a number from 1 on");
    const auto [place, isNew] = places.emplace(collision.number, collisions.size());
    if (isNew) {
      collisions.push_back(std::move(collision));
      continue;
    }
    ListedCollision& first = collisions[place->second];
    const bool isHeard = first.isHeard || collision.isHeard;
    if (collision.peak > first.peak) first = std::move(collision);
    first.isHeard = isHeard;
  }
  return collisions;
}

std::vector<ListedCollision> loudest(std::vector<ListedCollision> collisions, std::size_t count) {
  std::ranges::stable_sort(collisions, std::greater<>(), &ListedCollision::peak);
  if (collisions.size() > count) collisions.resize(count);
  return collisions;
}

}  // namespace carom::command
