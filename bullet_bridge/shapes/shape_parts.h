#pragma once

#include <cstdint>
#include <vector>

#include <btBulletCollisionCommon.h>

#include "bullet_bridge/shapes/convex_piece.h"

namespace carom::bullet {

/// The convex pieces of a shape and its meshes, in the frame of the body: what ShapePair follows of
/// it. They hold pointers into the shape, and are those that it has when they are made.
struct ShapeParts {
  struct Leaf {
    int type = 0;
    std::uint32_t piece = 0;
    std::uint32_t variant = 0;  // sharp box, or hull without margin; = piece if not made yet
    bool polyhedron = false;
  };
  struct ConcaveLeaf {
    const btConcaveShape* shape = nullptr;
    Eigen::Matrix3d rotation;
    Vec3 offset;
  };

  ShapeParts() = default;
  explicit ShapeParts(const btCollisionShape& shape) { read(shape); }
  /// Takes another shape, in the same memory.
  void read(const btCollisionShape& shape);

  /// True if the shape is a sphere or has flat faces only, so that turning it changes no more of
  /// its curvature than which of its faces, edges and corners touch.
  bool isRoundOrFlat() const { return roundOrFlat_; }

  std::vector<ConvexPiece> pieces;
  std::vector<Leaf> leaves;
  std::vector<ConcaveLeaf> concave;

 private:
  void collect(const btCollisionShape& shape, const Eigen::Matrix3d& rotation, const Vec3& offset);

  bool roundOrFlat_ = true;
};

}  // namespace carom::bullet
