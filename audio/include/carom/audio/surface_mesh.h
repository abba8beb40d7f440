#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include <carom/audio/vector.h>

namespace carom {

/// The surface of a solid as triangles; frame and origin are those of its maker. Closed: each edge
/// is traversed as often in one direction as in the other. Each triangle is counter-clockwise seen
/// from outside. None of this is checked here; closedSurface tests the edges.
struct SurfaceMesh {
  std::vector<Vec3> vertices;                           ///< m, body frame
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices into `vertices`

  bool operator==(const SurfaceMesh&) const = default;
};

/// Weights of the corners a, b and c in the point of their triangle that is nearest to `point`: at
/// least 0, of sum 1. Ericson 2005, Real-Time Collision Detection, section 5.1.5. [any thread]
std::array<double, 3> nearestInTriangle(const Vec3& point, const Vec3& a, const Vec3& b,
                                        const Vec3& c);

/// Enclosed volume in m^3, by the divergence theorem: negative for a surface that is inside out;
/// for several bodies the sum, less the cavities. Does not depend on the origin if the surface is
/// closed. [any thread]
double signedVolume(const SurfaceMesh& mesh);

/// Centre of the enclosed volume in m; not finite if there is none. [any thread]
Vec3 volumeCentroid(const SurfaceMesh& mesh);

/// Integral of x x^T over the enclosed volume in m^5, x from the point `from` (m): a solid of
/// uniform density has the inertia tensor density (trace - this integral) about `from` (Tonon 2004,
/// "Explicit exact formulas for the 3-D tetrahedron inertia tensor"). The sign is that of
/// signedVolume. [any thread]
Eigen::Matrix3d secondMoment(const SurfaceMesh& mesh, const Vec3& from);

/// Area of the surface in m^2. [any thread]
double surfaceArea(const SurfaceMesh& mesh);

/// True if each edge is traversed as often in one direction as in the other: then there is no
/// border, and no triangle is inside out against its neighbour. Vertices are compared by index:
/// coincident ones are not the same. Several bodies, cavities, and edges where four triangles meet
/// are closed too. [any thread]
bool closedSurface(const SurfaceMesh& mesh);

/// Returns for each point the index of the point that represents it: points within `distance` (m)
/// of each other have the same representative, and so do both ends of a chain of such neighbours,
/// as far as it runs along x. Time grows with the number of points. [any thread]
std::vector<std::uint32_t> coincident(const std::vector<Vec3>& points, double distance);

/// Returns the mesh with vertices within `tolerance` (m) of each other merged; triangles that
/// vanish, and vertices that no triangle uses, are dropped. `kept`, if given, receives the indices
/// of the triangles that are left. [any thread]
SurfaceMesh welded(const SurfaceMesh& mesh, double tolerance,
                   std::vector<std::uint32_t>* kept = nullptr);

}  // namespace carom
