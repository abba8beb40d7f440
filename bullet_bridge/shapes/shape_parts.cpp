#include "bullet_bridge/shapes/shape_parts.h"

#include <algorithm>

#include "bullet_bridge/geometry/to_vec3.h"

namespace carom::bullet {
namespace {

Eigen::Matrix3d toMatrix(const btMatrix3x3& m) {
  Eigen::Matrix3d matrix;
  for (int row = 0; row < 3; ++row)
    matrix.row(row) = toVec3(m[row]);
  return matrix;
}

}  // namespace

void ShapeParts::read(const btCollisionShape& shape) {
  pieces.clear();
  leaves.clear();
  concave.clear();
  collect(shape, Eigen::Matrix3d::Identity(), Vec3::Zero());
  roundOrFlat_ = std::ranges::all_of(pieces, [](const ConvexPiece& piece) {
    using Core = ConvexPiece::Core;
    const Core core = piece.core();
    return core == Core::box || core == Core::points || core == Core::triangle ||
           (core == Core::point && piece.offset().isZero(0.0));
  });
}

void ShapeParts::collect(const btCollisionShape& shape, const Eigen::Matrix3d& rotation,
                         const Vec3& offset) {
  const int type = shape.getShapeType();
  if (btBroadphaseProxy::isCompound(type)) {
    const auto& compound = static_cast<const btCompoundShape&>(shape);
    for (int child = 0; child < compound.getNumChildShapes(); ++child) {
      const btTransform& pose = compound.getChildTransform(child);
      collect(*compound.getChildShape(child), rotation * toMatrix(pose.getBasis()),
              offset + rotation * toVec3(pose.getOrigin()));
    }
    return;
  }
  Leaf leaf;
  leaf.type = type;
  leaf.piece = leaf.variant = static_cast<std::uint32_t>(pieces.size());
  if (type == STATIC_PLANE_PROXYTYPE) {
    pieces.push_back(ConvexPiece::from(static_cast<const btStaticPlaneShape&>(shape)));
  } else if (btBroadphaseProxy::isConvex(type)) {
    const auto& convex = static_cast<const btConvexShape&>(shape);
    const auto piece = ConvexPiece::from(convex);
    if (!piece) return;
    pieces.push_back(*piece);
    leaf.polyhedron =
        convex.isPolyhedral() &&
        static_cast<const btPolyhedralConvexShape&>(convex).getConvexPolyhedron() != nullptr;
  } else {
    if (btBroadphaseProxy::isConcave(type) && type != SDF_SHAPE_PROXYTYPE &&
        type != EMPTY_SHAPE_PROXYTYPE) {
      concave.push_back({static_cast<const btConcaveShape*>(&shape), rotation, offset});
    }
    return;
  }
  pieces.back().place(rotation, offset);
  leaves.push_back(leaf);
}

}  // namespace carom::bullet
