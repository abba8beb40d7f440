#pragma once

#include <cstddef>
#include <unordered_map>

#include <carom/audio/result.h>
#include <carom/audio/rigid_radiator.h>
#include <carom/audio/surface_mesh.h>

namespace carom {

/// The resolution at which a surface is solved.
struct PanelSettings {
  /// Largest number of panels in the finest solution, at least 160: memory grows with its square,
  /// time with its cube. Finer meshes are simplified.
  std::size_t panels = 1300;
  /// True: solve on coarser panels too and extrapolate the sequence to its limit. False: take the
  /// finest solution as it is.
  bool extrapolate = true;
  /// True: take far panels by their moments, and solve the finest equations by iteration, or
  /// directly where that does not settle (plates thinner than 1e-3). The result is the same within
  /// 1e-3, in a fifth of the time for hulls.
  bool quick = false;

  bool operator==(const PanelSettings&) const = default;
};

/// A radiator, and how far its numbers can be trusted.
struct PanelSolution {
  RigidRadiator radiator;
  std::size_t panels = 0;   ///< number of panels in the finest solution
  double asymmetry = 0.0;   ///< asymmetry of the added mass as solved: |M - M^T| / |M|
  double correction = 0.0;  ///< |limit - finest| / |limit|: change by extrapolation; 0 without
  double order = 0.0;       ///< assumed order of convergence in panel size; 0 without extrapolation
};

/// Added mass of a rigid body of any shape, by a panel method: the potential outside solves Green's
/// identity on the surface,
///
///     phi / 2 - integral phi dG/dn' dS' = - integral G v.n' dS',     G = 1 / (4 pi r),
///
/// on flat triangles with constant potential and constant source strength, at their centroids, all
/// influences in closed form (SourcePanel; Morino and Kuo 1974), for six unit motions;
/// M_ij = - sum phi_j v_i.n A. Dense LU. The normal derivatives are solid angles, whose sum
/// is exact: the source-only equation (Hess and Smith 1967) lacks that, is of first order on curved
/// surfaces, and fails for bodies thinner than a panel, which this equation handles.
///
/// Panels: a coarse mesh is halved along its longest edges to 40, then quartered up to twice;
/// the order of convergence is that of the three results, within 1 (edges of thin plates)
/// and 2 (smooth); with two results it is 1.2 for a body with sharp edges and 2 without; with one,
/// of a smooth mesh of more than `panels` / 4 triangles, nothing is extrapolated. Meshes that are
/// too fine are clustered first (clusteredSurface): over `panels` if smooth, over `panels` / 4 if
/// they have sharp edges, where extrapolation counts for more than shape. Volume and centroid
/// always are those of the mesh as given; clustering that changes it by 30 % is an error.
///
/// Measured: within 1 % for spheres of 128 triangles and more, 1.6 % for ellipsoids 1:2:3 and 1:5
/// of 512 and more; a cube of 12 to 12288 triangles between 0.636 and 0.640 of its volume; a square
/// plate to 1 % of the thin limit however thin; a round disc of thickness 1:100 to 8 %. The
/// surface that is solved is the polyhedron: one of 32 triangles is 4 % above the round sphere.
/// Turning is less exact: 5 % between two meshes of one box 1:2:3.
///
/// Errors: those of cleanSurface. Several bodies that do not touch are solved as one rigid body.
/// [any thread], allocates; 40 to 300 ms, and 10 to 50 ms if `quick`, for most bodies.
Result<PanelSolution> solvePanels(const SurfaceMesh& surface, const PanelSettings& settings = {});

/// Returns the radiator of solvePanels alone.
Result<RigidRadiator> panelRadiator(const SurfaceMesh& surface, const PanelSettings& settings = {});

/// A cache of radiators by the content of their meshes: one solution for all bodies of equal shape.
/// It keeps a copy of each mesh and compares it whole, so no entry goes stale; errors are kept too
/// (a mesh that is not finite equals no other, and takes a new entry each time).
/// [one thread at a time]
class RadiatorCache {
 public:
  /// Hash of a mesh by its content.
  struct Hash {
    std::size_t operator()(const SurfaceMesh& mesh) const;
  };

  explicit RadiatorCache(const PanelSettings& settings = {}) : settings_(settings) {}

  /// Returns panelRadiator(surface), solved the first time only. The reference is valid until the
  /// cache ends.
  const Result<RigidRadiator>& radiatorOf(const SurfaceMesh& surface);

  std::size_t size() const { return radiators_.size(); }

 private:
  PanelSettings settings_;
  std::unordered_map<SurfaceMesh, Result<RigidRadiator>, Hash> radiators_;
};

}  // namespace carom
