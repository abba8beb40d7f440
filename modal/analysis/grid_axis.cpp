#include "modal/analysis/grid_axis.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace carom::modal {
namespace {

constexpr int kCubic = 3;
constexpr double kSame = 1e-12;  // of a cell's size and its functions, relative

// Returns the four cubic functions between two knots, in powers of the place from one to the other:
// by Cox's and de Boor's recursion, degree by degree.
Eigen::Matrix4d piecesBetween(const std::vector<double>& knots, std::size_t span) {
  const double begin = knots[span];
  const double size = knots[span + 1] - begin;
  Eigen::Matrix4d pieces = Eigen::Matrix4d::Zero();  // of the degree so far, in the first rows
  pieces(0, 0) = 1.0;
  const auto addProduct = [](auto&& to, const Eigen::RowVector4d& from, double constant,
                             double slope) {
    to += constant * from;
    to.template tail<3>() += slope * from.template head<3>();
  };
  for (int degree = 1; degree <= kCubic; ++degree) {
    Eigen::Matrix4d next = Eigen::Matrix4d::Zero();
    for (int function = 0; function < degree; ++function) {
      const std::size_t low =
          span + 1 + static_cast<std::size_t>(function) - static_cast<std::size_t>(degree);
      const double left = knots[low];
      const double right = knots[low + static_cast<std::size_t>(degree)];
      const double share = 1.0 / (right - left);
      // It falls in the function that begins a knot earlier, and rises in its own.
      const Eigen::RowVector4d from = share * pieces.row(function);
      addProduct(next.row(function), from, right - begin, -size);
      addProduct(next.row(function + 1), from, begin - left, size);
    }
    pieces = next;
  }
  return pieces;
}

}  // namespace

Eigen::Vector4d AxisCell::at(double place, int derivative) const {
  Eigen::Matrix4d powers = pieces;
  for (int times = 0; times < derivative; ++times) {
    for (Eigen::Index power = 0; power < kCubic; ++power)
      powers.col(power) = static_cast<double>(power + 1) * powers.col(power + 1);
    powers.col(kCubic).setZero();
  }
  return powers.col(0) + place * (powers.col(1) + place * (powers.col(2) + place * powers.col(3)));
}

GridAxis::GridAxis(const std::vector<AxisLine>& lines) {
  assert(lines.size() >= 2);
  std::vector<double> knots;
  const double first = lines[1].at - lines[0].at;
  for (int beyond = kCubic; beyond > 0; --beyond)
    knots.push_back(lines.front().at - beyond * first);
  for (std::size_t line = 0; line < lines.size(); ++line) {
    const bool kinks = lines[line].kinks && line > 0 && line + 1 < lines.size();
    knots.insert(knots.end(), kinks ? kCubic : 1, lines[line].at);
  }
  const double last = lines.back().at - lines[lines.size() - 2].at;
  for (int beyond = 1; beyond <= kCubic; ++beyond)
    knots.push_back(lines.back().at + beyond * last);
  for (std::size_t span = kCubic; span + kCubic + 1 < knots.size(); ++span) {
    if (!(knots[span + 1] > knots[span])) continue;
    AxisCell cell{.begin = knots[span],
                  .size = knots[span + 1] - knots[span],
                  .first = static_cast<int>(span) - kCubic,
                  .pieces = piecesBetween(knots, span)};
    const auto same = std::ranges::find_if(cells_, [&](const AxisCell& other) {
      return std::abs(other.size - cell.size) <= kSame * cell.size &&
             (other.pieces - cell.pieces).cwiseAbs().maxCoeff() <= kSame;
    });
    cell.kind = same == cells_.end() ? cells() : same->kind;
    cells_.push_back(cell);
  }
  for (std::size_t function = 0; function + kCubic + 1 < knots.size(); ++function)
    middles_.push_back((knots[function + 1] + knots[function + 2] + knots[function + 3]) / 3.0);
}

GridAxis GridAxis::equal(double length, int cells) {
  std::vector<AxisLine> lines;
  for (int line = 0; line <= cells; ++line)
    lines.push_back({.at = length * line / cells});
  return GridAxis(lines);
}

int GridAxis::cellAt(double place) const {
  const auto next = std::ranges::upper_bound(cells_, place, {}, &AxisCell::begin);
  return std::max(static_cast<int>(next - cells_.begin()) - 1, 0);
}

}  // namespace carom::modal
