#pragma once

#include <cstddef>
#include <vector>

#include "carom/audio/vector.h"

namespace carom::scenes {

/// How many corners a hull that collides may have: separating two of them by their faces and edges
/// (btPolyhedralContactClipping) takes a time that grows with the third power of it: some
/// milliseconds.
inline constexpr std::size_t kMostCorners = 64;

/// Corners of the convex hull of some points that do not all lie in a plane: all
/// of them if there are at most `most`, and else those of a hull inside, to which always the corner
/// was added that stood out the farthest. Of the points themselves, each once. The outcome depends
/// on the order of the points only where two stand out equally far. [any thread], allocates.
std::vector<Vec3> collisionCorners(const std::vector<Vec3>& points,
                                   std::size_t most = kMostCorners);

}  // namespace carom::scenes
