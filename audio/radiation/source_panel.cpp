#include "audio/radiation/source_panel.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace carom::audio {
namespace {

// Integral (m^2) of the distance from a point along an edge. `from` and `to` are the edge's ends as
// seen from the point, `logarithm` is the integral of 1 / distance.
double distanceAlong(const Vec3& from, const Vec3& to, double length, double logarithm) {
  const Vec3 along = (to - from) / length;
  const double start = from.dot(along);
  const double end = to.dot(along);
  const double aside = from.squaredNorm() - start * start;  // squared distance of the edge's line
  return 0.5 * (end * to.norm() - start * from.norm() + aside * logarithm);
}

// Returns the integral of 1 / distance along an edge from the sum of the distances to its ends. A
// point on the edge, where it has no end, counts as one that lies beside it by as much as rounding
// tells: a panel that was folded over another has points there.
double reciprocalAlong(double sum, double length) {
  constexpr double kRounding = std::numeric_limits<double>::epsilon();
  return std::log((sum + length) / std::max(sum - length, kRounding * length));
}

// Returns the solid angle of a triangle whose corners are `to` as seen from a point.
double solidAngleOf(const std::array<Vec3, 3>& to, const std::array<double, 3>& distance) {
  return 2.0 * std::atan2(-to[0].dot(to[1].cross(to[2])),
                          distance[0] * distance[1] * distance[2] + to[0].dot(to[1]) * distance[2] +
                              to[1].dot(to[2]) * distance[0] + to[2].dot(to[0]) * distance[1]);
}

}  // namespace

SourcePanel::SourcePanel(const std::array<Vec3, 3>& corners)
    : corners_(corners), centroid_((corners[0] + corners[1] + corners[2]) / 3.0) {
  const Vec3 cross = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  area_ = 0.5 * cross.norm();
  normal_ = cross.normalized();
  for (std::size_t edge = 0; edge < 3; ++edge) {
    const Vec3 along = corners[(edge + 1) % 3] - corners[edge];
    lengths_[edge] = along.norm();
    outward_[edge] = along.cross(normal_) / lengths_[edge];
  }
}

SourceField SourcePanel::fieldAt(const Vec3& point) const {
  return field(point, false);
}

SourceField SourcePanel::fieldAtCentroid() const {
  return field(centroid_, true);
}

PanelView SourcePanel::viewFrom(const Vec3& point, bool inPlane) const {
  const std::array<Vec3, 3> to = {corners_[0] - point, corners_[1] - point, corners_[2] - point};
  const std::array<double, 3> distance = {to[0].norm(), to[1].norm(), to[2].norm()};
  PanelView view;
  for (std::size_t edge = 0; edge < 3; ++edge) {
    const double sum = distance[edge] + distance[(edge + 1) % 3];
    view.potential += to[edge].dot(outward_[edge]) * reciprocalAlong(sum, lengths_[edge]);
  }
  if (inPlane) return view;
  view.solidAngle = solidAngleOf(to, distance);
  view.potential += to[0].dot(normal_) * view.solidAngle;
  return view;
}

SourceField SourcePanel::field(const Vec3& point, bool inPlane) const {
  const std::array<Vec3, 3> to = {corners_[0] - point, corners_[1] - point, corners_[2] - point};
  const std::array<double, 3> distance = {to[0].norm(), to[1].norm(), to[2].norm()};
  SourceField field;
  for (std::size_t edge = 0; edge < 3; ++edge) {
    const double sum = distance[edge] + distance[(edge + 1) % 3];
    const double logarithm = reciprocalAlong(sum, lengths_[edge]);
    const double aside = to[edge].dot(outward_[edge]);
    field.potential += aside * logarithm;
    field.gradient -= logarithm * outward_[edge];
    field.distance +=
        aside / 3.0 * distanceAlong(to[edge], to[(edge + 1) % 3], lengths_[edge], logarithm);
  }
  if (inPlane) return field;
  const double height = -to[0].dot(normal_);
  const double solidAngle = solidAngleOf(to, distance);
  field.potential -= height * solidAngle;
  field.distance += height * height / 3.0 * field.potential;
  field.gradient -= solidAngle * normal_;
  return field;
}

}  // namespace carom::audio
