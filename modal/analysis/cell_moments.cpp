#include "modal/analysis/cell_moments.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <Eigen/Eigenvalues>

namespace carom::modal {
namespace {

constexpr std::size_t kPowers = kMomentPowers;
constexpr std::size_t kColumnMoments = kPowers * kPowers;
/// Degree of what is integrated over a piece of the surface: 7 in x, 6 in y and 6 in z.
constexpr double kDegree = 19.0;
constexpr std::size_t kMostPoints = 11;     // of Gauss's rule each way: exact
constexpr double kQuadratureError = 1e-11;  // relative, allowed for small pieces

// A triangle that up to six planes have cut.
struct Polygon {
  std::array<Vec3, 10> corners;
  std::size_t size = 0;

  void add(const Vec3& corner) {
    if (size < corners.size()) corners[size++] = corner;
  }
};

// Keeps what lies on one side of the plane where a coordinate has that value.
Polygon cut(const Polygon& polygon, Eigen::Index axis, double plane, bool keepsLow) {
  Polygon kept;
  const double side = keepsLow ? 1.0 : -1.0;
  for (std::size_t index = 0; index < polygon.size; ++index) {
    const Vec3& from = polygon.corners[index];
    const Vec3& to = polygon.corners[index + 1 < polygon.size ? index + 1 : 0];
    const double before = side * (from[axis] - plane);
    const double after = side * (to[axis] - plane);
    if (before <= 0.0) kept.add(from);
    if ((before < 0.0 && after > 0.0) || (before > 0.0 && after < 0.0)) {
      Vec3 crossing = from + (to - from) * (before / (before - after));
      crossing[axis] = plane;
      kept.add(crossing);
    }
  }
  if (kept.size < 3) kept.size = 0;
  return kept;
}

// Calls visit(place, polygon) for the part of the polygon in each cell, from the axis down to x.
template <class Visit>
void slice(const Polygon& polygon, const GridSurface& grid, std::size_t axis,
           std::array<int, 3>& place, const Visit& visit) {
  const auto along = static_cast<Eigen::Index>(axis);
  double low = polygon.corners[0][along];
  double high = low;
  for (std::size_t corner = 1; corner < polygon.size; ++corner) {
    low = std::min(low, polygon.corners[corner][along]);
    high = std::max(high, polygon.corners[corner][along]);
  }
  const int first = grid.firstBeyond(axis, low);
  const int last = std::max(grid.lastBelow(axis, high), first);
  for (int layer = first; layer <= last; ++layer) {
    Polygon part = polygon;
    if (layer > first) part = cut(part, along, grid.line(axis, layer), false);
    if (layer < last) part = cut(part, along, grid.line(axis, layer + 1), true);
    if (part.size == 0) continue;
    place[axis] = layer;
    if (axis == 0)
      visit(place, part);
    else
      slice(part, grid, axis - 1, place, visit);
  }
}

// Calls visit(index of the cell, corners) for each triangle of each piece, in the cell's
// coordinates.
template <class Visit>
void forEachPiece(const GridSurface& surface, const Visit& visit) {
  const auto add = [&](const std::array<int, 3>& place, const Polygon& part) {
    Vec3 near;
    Vec3 size;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto along = static_cast<Eigen::Index>(axis);
      near[along] = surface.line(axis, place[axis]);
      size[along] = surface.line(axis, place[axis] + 1) - near[along];
    }
    const auto inCell = [&](std::size_t corner) -> Vec3 {
      return (2.0 * (part.corners[corner] - near)).cwiseQuotient(size).array() - 1.0;
    };
    const std::size_t cell = indexOf(surface.count, place);
    for (std::size_t corner = 1; corner + 1 < part.size; ++corner)
      visit(cell, std::array<Vec3, 3>{inCell(0), inCell(corner), inCell(corner + 1)});
  };
  std::array<int, 3> place{};
  for (const auto& triangle : surface.triangles) {
    Polygon polygon;
    for (const Vec3& corner : triangle)
      polygon.add(corner);
    slice(polygon, surface, 2, place, add);
  }
}

// Twice the area, along the normal.
Vec3 crossOf(const std::array<Vec3, 3>& corners) {
  return (corners[1] - corners[0]).cross(corners[2] - corners[0]);
}

// ---- Quadrature on a triangle

struct GaussRule {
  std::array<double, kMostPoints> at{};  // from 0 to 1
  std::array<double, kMostPoints> weight{};
  std::size_t points = 0;
};

// By the eigenvalues of Jacobi's matrix (Golub and Welsch 1969).
GaussRule gaussRule(std::size_t points) {
  const auto size = static_cast<Eigen::Index>(points);
  Eigen::MatrixXd jacobi = Eigen::MatrixXd::Zero(size, size);
  for (Eigen::Index row = 1; row < size; ++row) {
    const auto order = static_cast<double>(row);
    jacobi(row, row - 1) = jacobi(row - 1, row) = order / std::sqrt(4.0 * order * order - 1.0);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solved(jacobi);
  GaussRule rule;
  rule.points = points;
  for (std::size_t point = 0; point < points; ++point) {
    const auto row = static_cast<Eigen::Index>(point);
    rule.at[point] = 0.5 + 0.5 * solved.eigenvalues()[row];
    rule.weight[point] = std::pow(solved.eigenvectors()(0, row), 2);
  }
  return rule;
}

// Rules for pieces of every size: what varies over the whole cell as a polynomial of high degree
// varies little over a small part of it.
class GaussRules {
 public:
  GaussRules() {
    for (std::size_t points = 1; points <= kMostPoints; ++points)
      rules_[points - 1] = gaussRule(points);
  }

  const GaussRule& forPiece(const std::array<Vec3, 3>& corners) const {
    double extent = 0.0;
    for (std::size_t side = 0; side < 3; ++side)
      extent =
          std::max(extent, (corners[side] - corners[(side + 1) % 3]).lpNorm<Eigen::Infinity>());
    double error = 1.0;
    for (std::size_t points = 1; points < kMostPoints; ++points) {
      const double turn = kDegree * extent / 8.0;
      const auto order = static_cast<double>(2 * points);
      error *= turn * turn / (order * (order - 1.0));
      if (error < kQuadratureError) return rules_[points - 1];
    }
    return rules_.back();
  }

 private:
  std::array<GaussRule, kMostPoints> rules_;
};

// Integrals over the part of the surface in a cell, each with the normal's x as a factor.
struct PieceMoments {
  CellMoments volume{};                         // of the antiderivative along x, from -1
  std::array<double, kColumnMoments> column{};  // of y^b z^c
};

void addPiece(PieceMoments& moments, const std::array<Vec3, 3>& corners, const GaussRule& rule) {
  const double across = crossOf(corners).x();
  if (across == 0.0) return;
  std::array<double, kPowers> x{};
  std::array<double, kPowers> y{};
  std::array<double, kPowers> z{};
  y[0] = z[0] = 1.0;
  for (std::size_t out = 0; out < rule.points; ++out) {
    for (std::size_t side = 0; side < rule.points; ++side) {
      const double far = rule.at[out];
      const Vec3 at =
          corners[0] + far * (corners[1] - corners[0] + rule.at[side] * (corners[2] - corners[1]));
      const double weight = across * far * rule.weight[out] * rule.weight[side];
      double power = 1.0;
      for (std::size_t a = 0; a < kPowers; ++a) {
        power *= at.x();
        x[a] = (power - (a % 2 == 0 ? -1.0 : 1.0)) / static_cast<double>(a + 1);
        if (a == 0) continue;
        y[a] = y[a - 1] * at.y();
        z[a] = z[a - 1] * at.z();
      }
      double* into = moments.volume.data();
      double* column = moments.column.data();
      for (std::size_t c = 0; c < kPowers; ++c) {
        for (std::size_t b = 0; b < kPowers; ++b, into += kPowers) {
          const double share = weight * y[b] * z[c];
          *column++ += share;
          for (std::size_t a = 0; a < kPowers; ++a)
            into[a] += share * x[a];
        }
      }
    }
  }
}

// Integral of x^power from -1 to 1.
double lineMoment(std::size_t power) {
  return power % 2 == 0 ? 2.0 / static_cast<double>(power + 1) : 0.0;
}

}  // namespace

int GridSurface::firstBeyond(std::size_t axis, double at) const {
  if (lines[axis].empty()) return std::clamp(static_cast<int>(std::floor(at)), 0, count[axis] - 1);
  const auto next = std::ranges::upper_bound(lines[axis], at);
  return std::clamp(static_cast<int>(next - lines[axis].begin()) - 1, 0, count[axis] - 1);
}

int GridSurface::lastBelow(std::size_t axis, double at) const {
  if (lines[axis].empty())
    return std::clamp(static_cast<int>(std::ceil(at)) - 1, 0, count[axis] - 1);
  const auto next = std::ranges::lower_bound(lines[axis], at);
  return std::clamp(static_cast<int>(next - lines[axis].begin()) - 1, 0, count[axis] - 1);
}

CellMoments momentsOf(const Vec3& low, const Vec3& high) {
  std::array<std::array<double, kPowers>, 3> line{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto along = static_cast<Eigen::Index>(axis);
    double from = 1.0;
    double to = 1.0;
    for (std::size_t power = 0; power < kPowers; ++power) {
      from *= low[along];
      to *= high[along];
      line[axis][power] = (to - from) / static_cast<double>(power + 1);
    }
  }
  CellMoments moments;
  double* into = moments.data();
  for (std::size_t c = 0; c < kPowers; ++c)
    for (std::size_t b = 0; b < kPowers; ++b)
      for (std::size_t a = 0; a < kPowers; ++a)
        *into++ = line[0][a] * line[1][b] * line[2][c];
  return moments;
}

GridFilling fillingOf(const GridSurface& surface) {
  const auto& count = surface.count;
  const std::size_t cells = indexOf(count, {0, 0, count[2]});
  GridFilling filling;
  filling.fraction.assign(cells, 0.0);
  std::vector<Vec3> area(cells, Vec3::Zero());  // of faces of a cell, each of which is 1
  forEachPiece(surface, [&](std::size_t cell, const std::array<Vec3, 3>& corners) {
    const Vec3 normal = crossOf(corners) / 8.0;
    const double far = (corners[0].x() + corners[1].x() + corners[2].x()) / 6.0 + 0.5;
    filling.fraction[cell] += far * normal.x();
    area[cell] += normal;
  });
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::vector<double>& near = filling.nearFace[axis];
    near.assign(cells, 0.0);
    std::array<int, 3> last = {count[0] - 1, count[1] - 1, count[2] - 1};
    const std::size_t stride = axis == 0   ? 1
                               : axis == 1 ? indexOf(count, {0, 1, 0})
                                           : indexOf(count, {0, 0, 1});
    std::array<int, 3> place{};
    const auto first = (axis + 1) % 3;
    const auto second = (axis + 2) % 3;
    for (place[first] = 0; place[first] <= last[first]; ++place[first]) {
      for (place[second] = 0; place[second] <= last[second]; ++place[second]) {
        // A flow along the axis leaves a cell at its far face as it came in at its near one, less
        // what passes through the surface.
        double inside = 0.0;
        std::size_t cell = indexOf(count, place);
        for (int layer = 0; layer <= last[axis]; ++layer, cell += stride) {
          near[cell] = inside;
          inside -= area[cell][static_cast<Eigen::Index>(axis)];
          if (axis == 0) filling.fraction[cell] += inside;
        }
      }
    }
  }
  return filling;
}

std::vector<CellMoments> momentsOf(const GridSurface& surface,
                                   const std::vector<std::int32_t>& wanted, std::size_t number) {
  const GaussRules rules;
  std::vector<std::int32_t> touched(wanted.size(), -1);
  std::vector<PieceMoments> pieces;
  forEachPiece(surface, [&](std::size_t cell, const std::array<Vec3, 3>& corners) {
    if (touched[cell] < 0) {
      touched[cell] = static_cast<std::int32_t>(pieces.size());
      pieces.emplace_back();
    }
    addPiece(pieces[static_cast<std::size_t>(touched[cell])], corners, rules.forPiece(corners));
  });
  std::vector<CellMoments> moments(number);
  const auto width = static_cast<std::size_t>(surface.count[0]);
  for (std::size_t row = 0; row < wanted.size(); row += width) {
    std::array<double, kColumnMoments> beyond{};  // of the face at the far end of the cell
    for (std::size_t cell = row + width; cell-- > row;) {
      const PieceMoments* own =
          touched[cell] < 0 ? nullptr : &pieces[static_cast<std::size_t>(touched[cell])];
      if (wanted[cell] >= 0) {
        double* into = moments[static_cast<std::size_t>(wanted[cell])].data();
        for (std::size_t index = 0; index < kColumnMoments; ++index)
          for (std::size_t a = 0; a < kPowers; ++a, ++into)
            *into = beyond[index] * lineMoment(a) +
                    (own == nullptr ? 0.0 : own->volume[index * kPowers + a]);
      }
      if (own == nullptr) continue;
      for (std::size_t index = 0; index < kColumnMoments; ++index)
        beyond[index] += own->column[index];
    }
  }
  return moments;
}

}  // namespace carom::modal
