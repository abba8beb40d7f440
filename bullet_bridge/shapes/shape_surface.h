#pragma once

#include <btBulletCollisionCommon.h>

#include "carom/audio/result.h"
#include "carom/audio/surface_mesh.h"

namespace carom::bullet {

/// The surface of a Bullet shape as the host sees it: closed, outward, m, in the frame of the shape
/// (a rigid body's centre of mass is its origin). Local scaling is applied. Margins are taken as in
/// Bullet's own debug drawing: inside the outline of boxes and cylinders, and not counted where
/// Bullet inflates the shape by them (hulls, cones, meshes), since they are a skin of the
/// collision.
///
///  - Box, convex hull, point cloud, tetrahedron: their polyhedron (btConvexHullComputer, which
///    may leave out points within 1e-4 of the hull's extent from the rest).
///  - Sphere, capsule, cylinder, cone: polyhedra of 32 to 256 triangles, with the exact volume.
///  - Multi-sphere: hull of its spheres, each as 66 points, a little outside. Other convex shapes:
///    hull of 258 support points, which is inside the shape: a smooth one loses about 3 % of
///    volume.
///  - Triangle meshes (static, GImpact, scaled): as they are; corners within 1e-6 of the extent are
///    merged. An open mesh is an error.
///  - Compound: the union of its convex children, each cut by the planes of the others, so boxes
///    that touch or overlap give the exact union. Children that are not convex are only allowed
///    alone or apart from all others (by bounding boxes). Where the cut does not close (tolerance
///    1e-5 of the extent, near-coincident faces), the outcome is the hull of all children: too much
///    volume for an L, never too little.
///
/// Returns an error with the kind of shape for planes, terrain, open meshes, shapes without volume,
/// signed distance fields, and anything else that is not a solid body. [physics thread], allocates.
Result<SurfaceMesh> shapeSurface(const btCollisionShape& shape);

}  // namespace carom::bullet
