#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "carom/audio/vector.h"

namespace carom::modal {

/// Powers of each coordinate in CellMoments: 0 to 6, those of products of two cubic functions.
inline constexpr std::size_t kMomentPowers = 7;

/// The moments of the part of a cell that is inside a body: integrals of x^a y^b z^c over it, in
/// coordinates that go from -1 to 1 along each of the cell's edges, at index
/// a + 7 b + 49 c. A whole cell has the volume 8.
using CellMoments = std::array<double, kMomentPowers * kMomentPowers * kMomentPowers>;

/// Returns the moments of a box in a cell; corners from -1 to 1.
CellMoments momentsOf(const Vec3& low, const Vec3& high);

/// A closed surface's triangles and the grid that cuts it. Corners turn counter-clockwise seen from
/// outside.
struct GridSurface {
  std::array<int, 3> count{};  ///< cells along each axis; the surface lies within
  std::vector<std::array<Vec3, 3>> triangles;
  /// Where the cells begin and end along each axis, ascending, count + 1 of them. Empty: each cell
  /// is a unit, the one at the place (i, j, k) from (i, j, k) to (i + 1, j + 1, k + 1).
  std::array<std::vector<double>, 3> lines{};

  double line(std::size_t axis, int number) const {
    return lines[axis].empty() ? number : lines[axis][static_cast<std::size_t>(number)];
  }
  /// Numbers of the first cell that reaches beyond a coordinate, and of the last that begins below.
  int firstBeyond(std::size_t axis, double at) const;
  int lastBelow(std::size_t axis, double at) const;
};

/// How full the cells of a grid are, at the index of their place, x fastest.
struct GridFilling {
  std::vector<double> fraction;  ///< share of each cell that is inside
  /// For each axis, the share of the cell's face at its near end that is inside.
  std::array<std::vector<double>, 3> nearFace;
};

/// Returns the index of a place in arrays over a grid.
inline std::size_t indexOf(const std::array<int, 3>& count, const std::array<int, 3>& place) {
  return (static_cast<std::size_t>(place[2]) * static_cast<std::size_t>(count[1]) +
          static_cast<std::size_t>(place[1])) *
             static_cast<std::size_t>(count[0]) +
         static_cast<std::size_t>(place[0]);
}

/// Returns how full the cells are, exactly (to rounding): each triangle is cut at the cells' faces,
/// and the divergence theorem takes volumes and areas from the pieces. A part that the surface
/// winds about twice counts twice. [any thread]
GridFilling fillingOf(const GridSurface& surface);

/// Returns the moments of the cells with wanted[index] >= 0, at that number; as exact as fillingOf.
/// `number` is one more than the largest. [any thread]
std::vector<CellMoments> momentsOf(const GridSurface& surface,
                                   const std::vector<std::int32_t>& wanted, std::size_t number);

}  // namespace carom::modal
