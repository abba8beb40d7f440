#pragma once

#include <limits>
#include <memory>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "carom/audio/surface_mesh.h"
#include "carom/audio/texture_coordinates.h"
#include "carom/audio/vector.h"

namespace carom::scenes {

/// The volume, centroid and inertia of a homogeneous body of density 1. [any thread]
struct SolidMeasures {
  double volume = 0.0;                                ///< m^3
  Vec3 centroid = Vec3::Zero();                       ///< m, in the frame of the shape
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  ///< m^5, about the centroid, same axes
};

/// A box. Its frame: the origin in the middle, the axes along the edges.
struct BoxForm {
  Vec3 halfExtents = Vec3::Ones();  ///< m, > 0
};

/// A cylinder. Its frame: the origin in the middle, y along the axis.
struct CylinderForm {
  double radius = 0.0;  ///< m, > 0
  double height = 0.0;  ///< m, > 0, full height
};

/// A mesh that a scene uses, scaled, and shared by all bodies that have it. Its frame is that of
/// its file.
struct SolidMesh {
  SurfaceMesh surface;  ///< m; closed and outward if a body that moves has it
  /// Texture coordinates by triangle; empty if the file has none.
  std::vector<TextureCoordinates::Corners> coordinates;
  /// Points of the convex pieces, m, at least one piece: a body that moves collides as their hulls.
  std::vector<std::vector<Vec3>> pieces;
};

/// A box, cylinder or mesh that moves freely, or that nothing can push. On Bullet only.
///
/// The frame of the body has the axes of the form. Its origin is at `centreOfMass`; for a body that
/// cannot move, at the origin of the form.
struct SolidShape {
  std::variant<BoxForm, CylinderForm, std::shared_ptr<const SolidMesh>> form;
  Vec3 centreOfMass = Vec3::Zero();  ///< m, in the frame of the form
  /// kg; infinite for a body that nothing can push.
  double mass = std::numeric_limits<double>::infinity();
  /// kg m^2, body frame, about the centre of mass; not used for a body that cannot move.
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
  Vec3 position = Vec3::Zero();         ///< m, world frame, of the centre of mass, at time 0
  Quat orientation = Quat::Identity();  ///< body to world, unit, at time 0
  Vec3 velocity = Vec3::Zero();         ///< m/s, world frame, of the centre of mass, at time 0
  Vec3 spin = Vec3::Zero();             ///< rad/s, world frame, at time 0

  bool canMove() const { return mass < std::numeric_limits<double>::infinity(); }
};

/// True if the solid is a mesh whose file has texture coordinates. [any thread]
bool hasTextureCoordinates(const SolidShape& solid);

/// Returns "box", "cylinder" or "mesh". [any thread]
const char* formName(const SolidShape& solid);

/// Computes the measures in closed form. [any thread]
SolidMeasures measuresOf(const BoxForm& box);
SolidMeasures measuresOf(const CylinderForm& cylinder);

/// Computes the measures of the volume inside a closed surface by the divergence theorem: the sum
/// over the tetrahedra that its triangles span with one point, each with the sign of its volume (F.
/// Tonon 2004, "Explicit exact formulas for the 3-D tetrahedron inertia tensor in terms of its
/// vertex coordinates"). Cavities count as such; a surface that is inside out has everything
/// negative. [any thread]
SolidMeasures measuresOf(const SurfaceMesh& surface);

/// The principal axes of a body, about which it turns without wobbling: the rotation from their
/// frame to the body's, and the inertia about each.
struct PrincipalAxes {
  Quat toBody = Quat::Identity();
  Vec3 inertia = Vec3::Ones();  ///< kg m^2
};

/// Returns the principal axes: the body's own where they are principal to 1e-9 of the largest
/// inertia, since for a cube, say, any axes would do. [any thread]
PrincipalAxes principalAxes(const Eigen::Matrix3d& inertia);

}  // namespace carom::scenes
