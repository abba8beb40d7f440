#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "audio/radiation/source_panel.h"
#include "carom/audio/surface_mesh.h"

namespace carom::modal {

/// Solves for the steady sound outside of closed surfaces whose normal velocity is known: the field
/// u exp(i w t) whose Laplacian is -k^2 u, that goes outwards, and that has the given slope du/dn
/// on the surface, by Helmholtz's integral equation there (Schenck 1968)
///
///     u / 2 - integral u dG/dn' dS' = - integral G du/dn' dS',    G = exp(-i k r) / (4 pi r)
///
/// on flat triangles with constant u and slope, averaged over four points of each triangle: the
/// centroid and half way from there to the corners. (The centroid alone gives the dipole of a thin
/// square plate of 670 panels 9 % too much, the other three 3 % too little.) Of exp(-i k r) / r the
/// terms 1 / r and -k^2 r / 2, which are not smooth where panels are near, are integrated in closed
/// form (SourcePanel), so bodies may be thinner than a panel; the rest by quadrature.
///
/// That equation alone fails near the resonances of the air that the surface would enclose, which
/// begin where k times the radius of the largest ball inside is pi / 2 (of a slab; convex bodies:
/// Hersch 1960). From 3/4 of that k on, points inside, where u must vanish, are added and all is
/// solved by least squares (CHIEF: Schenck 1968); otherwise by a dense LU. Matrices are factorised
/// in single precision, and solutions refined with the equations in double until they no longer
/// change.
///
/// A surface with mirror planes is given by the part on one side of them. A slope that each mirror
/// keeps, or turns round, makes a field that does the same, so the equations of the part suffice:
/// three mirrors make 512 times less of the cube below.
///
/// Time grows with the cube of the panels, memory with the square: 800 panels take 0.2 s and 0.4 s
/// with points inside, 60 MB. For its errors see computeRadiation. [any thread], allocates.
class ExteriorSolver {
 public:
  /// True for the axes across which the surface goes on as in a mirror, at the origin.
  using Mirrors = std::array<bool, 3>;
  /// Factor of a field, 1 or -1, in the mirror across each axis; no matter where there is none.
  using Parity = std::array<double, 3>;

  /// Takes a surface of triangles with an area, normals outwards; neighbours need not fit edge by
  /// edge. With mirrors it is the part where these coordinates are positive.
  explicit ExteriorSolver(const SurfaceMesh& surface, const Mirrors& mirrors = {});

  /// The surface's triangles, in their order; then those of each image.
  const std::vector<audio::SourcePanel>& panels() const { return panels_; }
  /// Number of panels of the part: all of them without mirrors.
  std::size_t partSize() const { return part_; }
  /// Returns the factor of a field of that parity on each panel, over that on the part's.
  std::vector<double> signsOf(const Parity& parity) const;

  /// True if points inside have a part in the solution at this wave number (1/m).
  bool usesInteriorPoints(double waveNumber) const;

  /// Returns u on each panel from du/dn on each panel. Wave number in 1/m, at least 0. Requires a
  /// surface without mirrors.
  Eigen::VectorXcd solve(double waveNumber, const Eigen::VectorXcd& slope) const;

  /// Slopes du/dn of one parity on the part's panels, one field in each column.
  struct Slopes {
    Parity parity = {1.0, 1.0, 1.0};
    Eigen::MatrixXcd values;
  };
  /// Returns the u of each of these fields on the part's panels; what they share is computed once.
  std::vector<Eigen::MatrixXcd> solve(double waveNumber, std::span<const Slopes> slopes) const;

  /// Bytes that one solution takes beside the solver, about, for so many panels of the part.
  static std::size_t memoryOf(std::size_t panels) { return 32 * panels * panels; }

  /// Quadrature of the second degree on a triangle: three points of a third of its area each.
  static std::array<Vec3, 3> nodesOf(const std::array<Vec3, 3>& corners);

 private:
  void addPanel(const std::array<Vec3, 3>& corners, bool hasEquation);
  void findInteriorPoints();
  void integrateClosedForms();
  struct Influence;
  // True for a panel's own equation: neither one inside nor that of an image.
  bool isOwn(std::size_t equation, std::size_t panel) const {
    return equation == panel && equation < part_;
  }
  const Eigen::Matrix3d& spreadOf(std::size_t equation) const {
    return equation < part_ ? spread_[equation] : kPoint;
  }
  static const Eigen::Matrix3d kPoint;
  struct Equations;
  Influence influenceNear(double waveNumber, std::size_t equation, std::size_t panel) const;
  Influence influenceFar(double waveNumber, std::size_t equation, std::size_t panel) const;

  std::size_t part_ = 0;
  std::vector<Mirrors> images_;  // the axes that each image turns round; none for the first
  std::vector<audio::SourcePanel> panels_;
  std::vector<std::array<Vec3, 3>> nodes_;    // quadrature points of each panel
  std::vector<std::vector<Vec3>> equations_;  // four points for a panel, one inside
  double depth_ = 0.0;                        // m, of the deepest point inside
  std::vector<Eigen::Matrix3d> spread_;       // m^2, second moments of a panel over its area
  // A row for each equation, a column for each panel; means over the points:
  Eigen::MatrixXd potential_;   // m, integral of 1 / r
  Eigen::MatrixXd solidAngle_;  // integral of -d(1 / r)/dn'
  Eigen::MatrixXd distance_;    // m^3, integral of r
  Eigen::MatrixXd climb_;       // m^2, integral of dr/dn'
};

}  // namespace carom::modal
