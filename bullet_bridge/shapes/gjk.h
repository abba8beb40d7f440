#pragma once

#include <array>
#include <limits>

#include "bullet_bridge/shapes/convex_piece.h"
#include "carom/audio/vector.h"

namespace carom::bullet {

/// A piece at one instant; coordinates are of a frame parallel to the world's.
struct PlacedPiece {
  const ConvexPiece* piece = nullptr;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< piece to world
  Vec3 position = Vec3::Zero();                            ///< m

  Vec3 toWorld(const Vec3& point) const { return position + rotation * point; }
  /// The point of the core farthest in a direction of any length.
  Vec3 support(const Vec3& direction) const {
    return toWorld(piece->support(rotation.transpose() * direction));
  }
};

struct CoreDistance {
  double distance = 0.0;           ///< m, 0 if the cores overlap; a half space's may be negative
  Vec3 normal = Vec3::Zero();      ///< unit, from `other` to `body`; zero if the cores overlap
  Vec3 point = Vec3::Zero();       ///< m, on body's core
  Vec3 otherPoint = Vec3::Zero();  ///< m, on other's core
  int iterations = 0;
};

/// The points of two cores that their nearest points lie between, each in the frame of its piece.
struct NearestCorners {
  std::size_t count = 0;  ///< 0 if not known
  struct Corner {
    Vec3 body = Vec3::Zero();
    Vec3 other = Vec3::Zero();
  };
  std::array<Corner, 4> corners;
};

/// Begin and end of a search for the distance of two cores.
struct DistanceSearch {
  /// Direction from other to body, of any length: the nearer to the normal the faster.
  Vec3 guess;
  /// The search stops as soon as distance and lower bound differ by no more than this fraction of
  /// the gap, which is the distance less both margins.
  double gapTolerance = 0.0;
  /// If given, these are where the search begins instead of the guess, and are set to where it
  /// ends: those of the same two pieces a little earlier are mostly found again at once.
  NearestCorners* corners = nullptr;
  /// Distance (m) beyond which no more need be known: the search stops once it is surely exceeded.
  double farthest = std::numeric_limits<double>::infinity();
};

/// Distance of two cores by the method of Gilbert, Johnson and Keerthi (1988), in double precision.
/// The sub-simplex that holds the nearest point is found by its signed volumes, after Montanari,
/// Petrinic and Barbieri (2017), but relative to one of its corners: that keeps the digits when a
/// simplex is small and far. Stops when distance and lower bound differ by 1e-12 of the distance or
/// by rounding, or after 100 iterations. Overlap of cores is found, not measured. [any thread]
CoreDistance coreDistance(const PlacedPiece& body, const PlacedPiece& other,
                          const DistanceSearch& search);
inline CoreDistance coreDistance(const PlacedPiece& body, const PlacedPiece& other,
                                 const Vec3& guess) {
  return coreDistance(body, other, DistanceSearch{.guess = guess});
}

}  // namespace carom::bullet
