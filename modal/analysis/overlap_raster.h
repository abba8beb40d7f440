#pragma once

#include <cstdint>
#include <vector>

#include "modal/analysis/cell_moments.h"

namespace carom::modal {

/// Returns how many times, in the mean over its inside, the surface winds about what is inside: 1
/// unless bodies overlap. By rays along x, some thousands of them. [any thread]
double meanWinding(const GridSurface& surface);

/// The same as fillingOf and momentsOf for a surface of bodies that overlap: what it winds about
/// more than once counts once. What is beyond that is found by rays along x, of which 8 by 8 pass
/// through each cell; a ray's part in a cell is exact, and stands for a row of the cell. All else
/// is exact. [any thread]
GridFilling unionFilling(const GridSurface& surface);
std::vector<CellMoments> unionMoments(const GridSurface& surface,
                                      const std::vector<std::int32_t>& wanted, std::size_t number);

}  // namespace carom::modal
