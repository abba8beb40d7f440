#pragma once

#include <array>

#include "carom/audio/vector.h"

namespace carom::audio {

/// The field, at a point, of a triangle with source strength 1 per area.
struct SourceField {
  double potential = 0.0;        ///< m, the integral of 1 / distance over the triangle
  Vec3 gradient = Vec3::Zero();  ///< 1, of the potential, with respect to the point
  double distance = 0.0;         ///< m^3, the integral of the distance over the triangle
};

/// A triangle as seen from a point.
struct PanelView {
  double potential = 0.0;   ///< m, as in SourceField
  double solidAngle = 0.0;  ///< positive where the normal points to; 0 in the triangle's plane
};

/// A flat triangle of constant source strength, its potential in closed form: logarithms of its
/// edges and one solid angle (Hess and Smith 1967; in the form of Wilton et al. 1984, eq. 5, and
/// Graglia 1993; the logarithm after Newman 1986; the solid angle after van Oosterom and Strackee
/// 1983). The integral of the distance by the divergence theorem in the plane, where the divergence
/// of (place in the plane) x distance is 3 distance - height^2 / distance. Exact to rounding. On
/// the triangle the gradient is that of its plane: the jump of 2 pi either way along the normal is
/// left to the caller. On an edge it is infinite. [any thread]
class SourcePanel {
 public:
  /// Three corners, counter-clockwise about the normal, not on one line.
  explicit SourcePanel(const std::array<Vec3, 3>& corners);

  const std::array<Vec3, 3>& corners() const { return corners_; }
  const Vec3& centroid() const { return centroid_; }  ///< m
  const Vec3& normal() const { return normal_; }      ///< unit
  double area() const { return area_; }               ///< m^2

  SourceField fieldAt(const Vec3& point) const;
  /// The parts of the field that panels on one surface need of each other; `inPlane` if the point
  /// is in the triangle.
  PanelView viewFrom(const Vec3& point, bool inPlane) const;
  /// The field at the panel's own centroid.
  SourceField fieldAtCentroid() const;

 private:
  SourceField field(const Vec3& point, bool inPlane) const;

  std::array<Vec3, 3> corners_;
  std::array<Vec3, 3> outward_;    // normal of edge k from corner k to the next: unit, in the plane
  std::array<double, 3> lengths_;  // lengths of the edges
  Vec3 centroid_;
  Vec3 normal_;
  double area_;
};

}  // namespace carom::audio
