#include "plugin/bullet/listener_placement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace carom::plugin {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kHalfView = 25.0 * kDegree;
constexpr std::array kElevations = {25.0 * kDegree, 45.0 * kDegree, 65.0 * kDegree, 85.0 * kDegree};
constexpr std::array kAzimuths = {0.0,   30.0,  -30.0,  60.0,  -60.0,  90.0,
                                  -90.0, 120.0, -120.0, 150.0, -150.0, 180.0};  // degrees
/// m: the microphones of the pair are 17 cm apart.
constexpr double kLeastDistance = 0.5;
/// Bodies that lie farther from the middle than so many times the distance that half of them keep
/// are left out.
constexpr double kFarOut = 8.0;
/// Share of the way to what is met that is left as a margin.
constexpr double kMargin = 0.1;
/// Bodies that are looked for, at most, beside the sphere's centre.
constexpr std::size_t kMostSeen = 6;
/// Factor on a body's radius in which no listener stands.
constexpr double kClear = 1.5;

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

Vec3 medianCentre(std::span<const PlacementBody> bodies) {
  Vec3 centre;
  std::vector<double> values(bodies.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::ranges::transform(bodies, values.begin(),
                           [axis](const PlacementBody& body) { return body.centre[axis]; });
    centre[axis] = median(values);
  }
  return centre;
}

bool isThere(const PlacementBody& body, const PlacementScene& scene) {
  if (!body.centre.allFinite() || !std::isfinite(body.radius)) return false;
  return !scene.lowest || scene.up.dot(body.centre) + body.radius >= *scene.lowest;
}

/// Leaves out the bodies that are far from most others.
void leaveOutFar(std::vector<PlacementBody>& bodies) {
  const Vec3 middle = medianCentre(bodies);
  const auto reach = [&](const PlacementBody& body) {
    return (body.centre - middle).norm() + body.radius;
  };
  std::vector<double> reaches(bodies.size());
  std::ranges::transform(bodies, reaches.begin(), reach);
  const double most = kFarOut * median(reaches);
  std::erase_if(bodies, [&](const PlacementBody& body) { return reach(body) > most; });
}

PlacementSphere boundOf(std::span<const PlacementBody> bodies) {
  Vec3 low = bodies.front().centre;
  Vec3 high = low;
  for (const PlacementBody& body : bodies) {
    low = low.cwiseMin(body.centre - Vec3::Constant(body.radius));
    high = high.cwiseMax(body.centre + Vec3::Constant(body.radius));
  }
  PlacementSphere sphere{.centre = 0.5 * (low + high)};
  for (const PlacementBody& body : bodies)
    sphere.radius = std::max(sphere.radius, (body.centre - sphere.centre).norm() + body.radius);
  return sphere;
}

/// Returns the horizontal direction from which a camera looks first: +Z where that is level, -Y
/// where Z is up.
Vec3 frontOf(const Vec3& up) {
  const Vec3 front = Vec3::UnitZ() - up.z() * up;
  if (front.norm() > 0.1) return front.normalized();
  return (-Vec3::UnitY() + up.y() * up).normalized();
}

/// A view of the bodies, from one side.
class View {
 public:
  View(const PlacementSphere& sphere, std::span<const PlacementBody> bodies,
       const PlacementScene& scene)
      : sphere_(sphere),
        bodies_(bodies),
        scene_(scene),
        distance_(std::max(sphere.radius / std::sin(kHalfView), kLeastDistance)) {
    targets_.push_back(sphere.centre);
    const std::size_t stride = std::max<std::size_t>(1, bodies.size() / kMostSeen);
    for (std::size_t index = 0; index < bodies.size(); index += stride)
      if ((bodies[index].centre - sphere.centre).norm() <= sphere.radius)
        targets_.push_back(bodies[index].centre);
  }

  Vec3 at(const Vec3& direction, double share) const {
    return sphere_.centre + share * distance_ * direction;
  }
  /// Returns the share of the distance that is free from the sphere's centre.
  double freeShare(const Vec3& direction) const {
    const double free = scene_.freeShare ? scene_.freeShare(sphere_.centre, at(direction, 1.0)) : 1;
    return free < 1.0 ? (1.0 - kMargin) * free : 1.0;
  }
  /// Returns the number of bodies, and of the centre, that are seen from a place.
  std::size_t seenFrom(const Vec3& place) const {
    if (!scene_.freeShare) return targets_.size();
    return static_cast<std::size_t>(std::ranges::count_if(
        targets_, [&](const Vec3& target) { return scene_.freeShare(target, place) >= 1.0; }));
  }
  bool isInBody(const Vec3& place) const {
    return std::ranges::any_of(bodies_, [&](const PlacementBody& body) {
      return (body.centre - place).norm() < kClear * body.radius;
    });
  }
  std::size_t targets() const { return targets_.size(); }

 private:
  const PlacementSphere& sphere_;
  std::span<const PlacementBody> bodies_;
  const PlacementScene& scene_;
  double distance_;
  std::vector<Vec3> targets_;
};

}  // namespace

std::optional<PlacementSphere> sphereAround(std::span<const PlacementBody> bodies,
                                            const PlacementScene& scene) {
  std::vector<PlacementBody> there;
  std::ranges::copy_if(bodies, std::back_inserter(there),
                       [&](const PlacementBody& body) { return isThere(body, scene); });
  if (there.empty()) return std::nullopt;
  leaveOutFar(there);
  return boundOf(there);
}

ListenerPlacement placeListener(const PlacementSphere& sphere,
                                std::span<const PlacementBody> bodies,
                                const PlacementScene& scene) {
  const View view(sphere, bodies, scene);
  const Vec3 front = frontOf(scene.up);
  const Vec3 side = scene.up.cross(front);
  ListenerPlacement best{.position = view.at(front, 1.0), .seen = sphere};
  double mostFree = -1.0;
  for (const double elevation : kElevations) {
    for (const double azimuth : kAzimuths) {
      const double turn = azimuth * kDegree;
      const Vec3 level = std::cos(turn) * front + std::sin(turn) * side;
      const Vec3 direction = std::cos(elevation) * level + std::sin(elevation) * scene.up;
      const double free = view.freeShare(direction);
      const Vec3 place = view.at(direction, free);
      if (view.isInBody(place)) continue;
      const std::size_t seen = view.seenFrom(place);
      const double score = free * static_cast<double>(seen) / static_cast<double>(view.targets());
      if (score <= mostFree) continue;
      mostFree = score;
      best.position = place;
      if (score == 1.0) return best;
    }
  }
  return best;
}

Quat lookingAt(const Vec3& position, const Vec3& target, const Vec3& up) {
  const Vec3 back = (position - target).normalized();
  Vec3 right = up.cross(back);
  if (!(right.norm() > 1e-6)) right = back.unitOrthogonal();
  right.normalize();
  Eigen::Matrix3d axes;
  axes << right, back.cross(right), back;
  return Quat(Eigen::Quaterniond(axes).normalized());
}

}  // namespace carom::plugin
