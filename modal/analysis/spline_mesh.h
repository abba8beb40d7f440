#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "carom/audio/result.h"
#include "carom/audio/surface_mesh.h"
#include "carom/modal/analysis_settings.h"
#include "modal/analysis/cell_moments.h"
#include "modal/analysis/grid_axis.h"
#include "modal/analysis/solid_element.h"

namespace carom::modal {

/// A cell of the grid, a cuboid with a part inside the body.
struct SplineCell {
  std::array<int, 3> place{};  ///< position in the grid
  /// Index into SplineMesh::moments of its part inside; -1: it is inside as a whole.
  std::int32_t moments = -1;
  std::array<std::uint32_t, kCellFunctions> nodes{};  ///< node of each function, x fastest
};

/// A point in, or close to, a cell: a field at the point is the sum of weights times the
/// coefficients of the cell's nodes.
struct CellPoint {
  std::size_t cell = 0;
  std::array<double, kCellFunctions> weights{};  ///< by function; their sum is 1
};

/// A solid on a grid of cells that its surface cuts where it will (finite cell method:
/// Parvizian, Duester, Rank 2007), with displacements in cubic B-splines on that grid (as
/// Schillinger and Rank 2011): smooth functions of four cells' width along each axis, one of them
/// to a cell, each with a node. Cells are equal but where a plane of the grid lies on one side of a
/// sharp inner edge, as of a box's bottom and walls: there functions may have a kink, and cells are
/// smaller.
///
/// The grid's frame is turned as `axes` and begins at `origin`; everything else here is in the
/// body's frame.
struct SplineMesh {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< columns: the grid's x, y, z
  Vec3 origin = Vec3::Zero();                          ///< m, the grid's corner 0
  std::array<GridAxis, 3> along;                       ///< cells and functions along x, y, z
  Vec3 cellSize = Vec3::Zero();                        ///< m, edges of the largest cells
  std::array<int, 3> count{};                          ///< cells along each axis
  /// m, the middle of each function: as its coefficients, they make a field that is the place
  /// itself. So a linear field's coefficients are its values at the nodes. Other fields' are not.
  std::vector<Vec3> nodes;
  std::vector<std::array<int, 3>> functions;  ///< of each node, its function along each axis
  std::vector<SplineCell> cells;              ///< cells with a part inside
  std::vector<CellMoments> moments;
  std::vector<std::int32_t> cellAt;  ///< index into `cells` by place, x fastest; -1: none
  double volume = 0.0;               ///< m^3, of the body; what overlaps counts once
  double innerEdges = 0.0;           ///< m, length of the sharp inner edges (sharpInnerEdges)
  double openEdges = 0.0;            ///< m, of those of which a side lies on no plane of the grid
  std::vector<std::uint32_t> openCells;  ///< index of each cell that such an edge passes, ascending
};

/// Returns the grid of the inside of a closed surface; for overlapping bodies, of their union.
///
/// Frame: the axes of the mesh, the principal axes of its volume, or those of one of its largest
/// triangles, whichever has the smallest bounding box (the first, if the others gain less than 0.1
/// %). Cells divide that box exactly along each axis, so that a box is whole cells only. Their
/// edges scale with the fourth root of the box's edges, within 1 : 5: cubes for a body as thick as
/// long, flat cells for a flat body.
///
/// The moments of cells are exact; those of bodies that overlap are taken along rays. Where the
/// parts of the body under one function do not hang together through the cells, as on both sides of
/// a slot of a cell's width, each part has a function of its own. Parts that lie nearer to each
/// other than a cell become one, unnoticed. In a cut cell the part outside is filled by a material
/// of a thousand-millionth of the stiffness and density, so that no function is left without.
///
/// Errors: indices out of range, coordinates that are not finite, an open surface, no volume,
/// settings without sense, several bodies that do not touch. [any thread], allocates.
Result<SplineMesh> splineMesh(const SurfaceMesh& surface, const GridSettings& settings = {});

/// Returns a cell's sides.
inline CellAxes sidesOf(const SplineMesh& mesh, const SplineCell& cell) {
  return {&mesh.along[0][cell.place[0]], &mesh.along[1][cell.place[1]],
          &mesh.along[2][cell.place[2]]};
}

/// Returns the cell that holds the point (m, body frame), or the nearest one. [any thread]
CellPoint locate(const SplineMesh& mesh, const Vec3& point);

}  // namespace carom::modal
