#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "carom/audio/result.h"
#include "carom/audio/surface_mesh.h"
#include "carom/modal/analysis_settings.h"

namespace carom::modal {

/// A box in a cell, from 0 to 1 along each of the cell's edges.
struct CellBox {
  Vec3 low = Vec3::Zero();
  Vec3 high = Vec3::Ones();
};

/// A hexahedron of the grid. Corner k is at the far end of x if k & 1, of y if k & 2, of z if k
/// & 4.
struct VoxelCell {
  std::array<int, 3> place;            ///< position in the grid
  std::array<std::uint32_t, 8> nodes;  ///< node at each corner
  /// The cell's part inside the body, as a range of VoxelMesh::boxes; an empty range: it is inside
  /// as a whole.
  std::uint32_t firstBox = 0;
  std::uint32_t boxCount = 0;
};

/// A point in, or close to, a cell: a field at the point is the sum of weights times nodal values.
struct CellPoint {
  std::size_t cell = 0;
  std::array<double, 8> weights{};  ///< trilinear, by corner; beyond 0 to 1 outside the cell
};

/// A solid as a grid of equal hexahedra that the surface may cut: the part inside each is given as
/// boxes to integrate over (finite cell method: Parvizian, Duester, Rank 2007).
///
/// The grid's frame is turned as `axes` and begins at `origin`; everything else here is in the
/// body's frame.
struct VoxelMesh {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< columns: the grid's x, y, z
  Vec3 origin = Vec3::Zero();                          ///< m, the grid's corner 0
  Vec3 cellSize = Vec3::Zero();                        ///< m, edges of a cell
  std::array<int, 3> count{};                          ///< cells along each axis
  std::vector<Vec3> nodes;       ///< m, corners of the cells below, and no others
  std::vector<VoxelCell> cells;  ///< cells with a part inside
  std::vector<CellBox> boxes;
  std::vector<std::int32_t> cellAt;  ///< index into `cells` by place, x fastest; -1: none
  double volume = 0.0;               ///< m^3, of the body: that of the surface, less overlaps
  double sampled = 0.0;              ///< m^3, of the inside parts of `cells`; about `volume`
};

/// Returns the grid of the inside of a closed surface; for overlapping bodies, of their union.
///
/// Frame: the axes of the mesh, the principal axes of its volume, or those of one of its largest
/// triangles, whichever has the smallest bounding box (the first, if the others gain less than 0.1
/// %). Cells divide that box exactly along each axis, so that a box is whole cells only. Their
/// edges scale with the fourth root of the box's edges, within 1 : 5: cubes for a body as thick as
/// long, flat cells for a flat body. There are at least two across each side, unless they would be
/// flatter than 1 : 5.
///
/// A point is inside if a ray along the grid's x has wound about positively there. The ray's part
/// in a cell is exact, and stands for a row of 1 / rows by 1 / rows of the cell. Cells of which
/// less than 1 % is inside are left out.
///
/// Errors: indices out of range, coordinates that are not finite, an open surface, no volume,
/// settings without sense; and a grid too coarse for the body: in several pieces (cells hang
/// together where both are filled to a common face), or with a volume off by more than 5 %. In that
/// case the message names a size of cell that would do, if one of at least an eighth does. Parts
/// that are nearer to each other than a cell become one, unnoticed. [any thread], allocates.
Result<VoxelMesh> voxelMesh(const SurfaceMesh& surface, const VoxelSettings& settings = {});

/// Returns the cell that holds the point (m, body frame), or the nearest one. [any thread]
CellPoint locate(const VoxelMesh& mesh, const Vec3& point);

}  // namespace carom::modal
