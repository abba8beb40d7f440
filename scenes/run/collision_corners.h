#pragma once

#include <cstddef>
#include <vector>

#include "carom/audio/vector.h"

namespace carom::scenes {

/// Most corners of a hull that collides. The time to separate two hulls by their faces and edges
/// (btPolyhedralContactClipping) grows with the third power of their number: some milliseconds.
inline constexpr std::size_t kMostCorners = 64;

/// Returns corners of the convex hull of `points`, which do not all lie in a
/// plane: all of them if there are at most `most`, and else those of a hull inside
/// it, built by always adding the corner that stands out the farthest. Each corner
/// is one of `points`, without repetition. The outcome depends on the order of the
/// points only where two stand out equally far. [any thread], allocates.
std::vector<Vec3> collisionCorners(const std::vector<Vec3>& points,
                                   std::size_t most = kMostCorners);

}  // namespace carom::scenes
