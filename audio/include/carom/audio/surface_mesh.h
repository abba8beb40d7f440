#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include <carom/audio/vector.h>

namespace carom {

/// The surface of a solid as triangles, in the frame and about the origin of whoever made it.
/// Closed: each edge is passed as often one way as the other. Each triangle counter-clockwise seen
/// from outside. None of this is checked here; closedSurface says whether it holds.
struct SurfaceMesh {
  std::vector<Vec3> vertices;                           ///< m, body frame
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices into `vertices`

  bool operator==(const SurfaceMesh&) const = default;
};

/// Weights of the corners a, b and c in the point of their triangle that is nearest to `point`: at
/// least 0, of sum 1. Ericson 2005, Real-Time Collision Detection, section 5.1.5. [any thread]
std::array<double, 3> nearestInTriangle(const Vec3& point, const Vec3& a, const Vec3& b,
                                        const Vec3& c);

/// m^3, by the divergence theorem: negative for a surface that is inside out, the sum for several
/// bodies, less the cavities. Does not depend on the origin if the surface is closed. [any thread]
double signedVolume(const SurfaceMesh& mesh);

/// m, the centre of the enclosed volume; not finite if there is none. [any thread]
Vec3 volumeCentroid(const SurfaceMesh& mesh);

/// m^5, the integral of x x^T over the enclosed volume, x from the point `from` (m): a solid of
/// even density has the inertia density (trace - this) about it (Tonon 2004, "Explicit exact
/// formulas for the 3-D tetrahedron inertia tensor"). Signs as of signedVolume. [any thread]
Eigen::Matrix3d secondMoment(const SurfaceMesh& mesh, const Vec3& from);

/// m^2. [any thread]
double surfaceArea(const SurfaceMesh& mesh);

/// Whether each edge is passed as often one way as the other: so no border, and no two neighbours
/// of which one is inside out. By indices: vertices that coincide are not the same. Several bodies,
/// cavities, and edges where four triangles meet are closed too. [any thread]
bool closedSurface(const SurfaceMesh& mesh);

/// For each point the one that stands for it: points within `distance` (m) of each other have the
/// same, and so do both ends of a chain of such neighbours, as far as it runs along x. Time grows
/// with the number of points. [any thread]
std::vector<std::uint32_t> coincident(const std::vector<Vec3>& points, double distance);

/// Vertices within `tolerance` (m) of each other become one; triangles that vanish are dropped, and
/// vertices that no triangle uses. `kept`, if given, is told which triangles are left. [any thread]
SurfaceMesh welded(const SurfaceMesh& mesh, double tolerance,
                   std::vector<std::uint32_t>* kept = nullptr);

}  // namespace carom
