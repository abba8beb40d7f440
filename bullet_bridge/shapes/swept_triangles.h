#pragma once

#include <array>

#include "bullet_bridge/geometry/rigid_motion.h"
#include "bullet_bridge/geometry/to_vec3.h"
#include "bullet_bridge/shapes/convex_piece.h"

namespace carom::bullet {

/// An axis-aligned box (m) in the frame of a mesh.
struct MeshFrameBox {
  Vec3 low, high;
  MeshFrameBox grownBy(double reach) const {
    return {low - Vec3::Constant(reach), high + Vec3::Constant(reach)};
  }
};

/// Returns the region that a piece of a moving body may pass through in [0, horizon] (s), seen from
/// a mesh that is part of another moving body, where it has the given rotation and offset.
MeshFrameBox meshFrameBox(const ConvexPiece& piece, const RigidMotion& body,
                          const RigidMotion& meshBody, const Eigen::Matrix3d& meshRotation,
                          const Vec3& meshOffset, double horizon);

bool mayReachInto(const std::array<Vec3, 3>& triangle, const MeshFrameBox& box);
btVector3 roundedOutwards(const Vec3& corner, bool up);

/// Calls `visit` with the triangles of a mesh that may reach into the box.
template <class Visit>
void forEachTriangle(const btConcaveShape& mesh, const MeshFrameBox& box, Visit visit) {
  struct Visitor : btTriangleCallback {
    Visitor(const MeshFrameBox& within, Visit& call) : box(within), visit(call) {}
    void processTriangle(btVector3* triangle, int, int) override {
      const std::array<Vec3, 3> corners{toVec3(triangle[0]), toVec3(triangle[1]),
                                        toVec3(triangle[2])};
      if (mayReachInto(corners, box)) visit(corners);
    }
    const MeshFrameBox& box;
    Visit& visit;
  };
  if (!box.low.allFinite() || !box.high.allFinite()) return;  // Bullet would quantize the box
  Visitor visitor(box, visit);
  mesh.processAllTriangles(&visitor, roundedOutwards(box.low, false),
                           roundedOutwards(box.high, true));
}

}  // namespace carom::bullet
