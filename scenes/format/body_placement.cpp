#include "scenes/format/body_placement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <string>
#include <utility>
#include <variant>

#include "scenes/format/mechanics_reader.h"

namespace carom::scenes {

using namespace modal;

namespace {

constexpr double kOverlapTolerance = 1e-9;  // share of the radius, for rounding in the file
constexpr double kPlacingClearance = 1e-3;  // share of the radius, gap between spheres of groups
constexpr int kTriesPerSphere = 2000;
constexpr std::uint64_t kMaxPlacingWork = 200'000'000;  // distances computed; some seconds

bool isPlane(const SceneBody& body) {
  return std::holds_alternative<PlaneShape>(body.shape);
}

bool isWall(const SceneBody& body) {
  return isPlane(body) || std::holds_alternative<BlockShape>(body.shape);
}

}  // namespace

BodyPlacement::BodyPlacement(Scene& scene, std::vector<JsonNode> entries,
                             std::vector<PendingGroup> groups)
    : scene_(scene), entries_(std::move(entries)), groups_(std::move(groups)) {
  std::vector<bool> isPending(scene_.bodies.size());
  for (const PendingGroup& group : groups_)
    for (std::size_t member = 0; member < group.count; ++member)
      isPending[group.firstBody + member] = true;
  for (std::size_t body = 0; body < scene_.bodies.size(); ++body)
    if (!isPending[body]) addBody(body);
}

void BodyPlacement::addBody(std::size_t body) {
  const SceneBody& added = scene_.bodies[body];
  if (isWall(added)) walls_.push_back(body);
  if (std::holds_alternative<SphereShape>(added.shape)) fixedSpheres_.push_back(body);
  if (const auto* jello = std::get_if<std::shared_ptr<const JelloShape>>(&added.shape))
    addJello(body, **jello);
}

void BodyPlacement::addJello(std::size_t body, const JelloShape& jello) {
  jello_ = body;
  skin_.emplace(jello.lattice.count);
  for (const Vec3& point : jello.positions) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      skinPlaces_[axis].push_back(point[static_cast<Eigen::Index>(axis)]);
    skinBox_.extend(point);
  }
}

/// The larger spheres come first, so that a query never meets smaller ones (see SphereGrid); none
/// in the grid overlap, so that its cells hold few.
void BodyPlacement::checkOverlaps() {
  checkJello();
  sortLargestFirst(fixedSpheres_);
  for (const std::size_t body : fixedSpheres_) {
    const SphereShape& shape = sphere(body);
    checkWalls(body);
    if (isInJello(shape.position, (1.0 - kOverlapTolerance) * shape.radius))
      entries_[body].fail(inQuotes(scene_.bodies[body].name) + " reaches into the jello" +
                          kAtTheStart + "it outside");
    checkSpheres(body);
    if (entries_[body].failed()) return;
    grid_.insert({shape.position, shape.radius, body});
  }
}

/// Refuses a jello that reaches into a plane, which would throw the points beyond it out.
void BodyPlacement::checkJello() const {
  if (!jello_) return;
  const JelloShape& jello = *jelloOf(scene_);
  const double allowed = kOverlapTolerance * jello.lattice.size.maxCoeff();
  for (const std::size_t wall : walls_) {
    if (!isPlane(scene_.bodies[wall])) continue;
    double least = std::numeric_limits<double>::infinity();
    for (const Vec3& point : jello.positions)
      least = std::min(least, gapToWall(wall, point, 0.0));
    if (least >= -allowed) continue;
    entries_[*jello_].fail(inQuotes(scene_.bodies[*jello_].name) + " reaches " +
                           formatNumber(-least) + " metres into " +
                           inQuotes(scene_.bodies[wall].name) + kAtTheStart +
                           "it on the side the normal points to");
    return;
  }
}

void BodyPlacement::checkWalls(std::size_t body) const {
  const SphereShape& shape = sphere(body);
  for (const std::size_t wall : walls_) {
    const double gap = gapToWall(wall, shape.position, shape.radius);
    if (gap >= -kOverlapTolerance * shape.radius) continue;
    std::string fault = inQuotes(scene_.bodies[body].name);
    fault += std::isinf(gap) ? " has its centre inside "
                             : " reaches " + formatNumber(-gap) + " metres into ";
    fault += inQuotes(scene_.bodies[wall].name);
    entries_[body].fail(
        fault + kAtTheStart + "it " +
        (isPlane(scene_.bodies[wall]) ? "on the side the normal points to" : "outside"));
    return;
  }
}

/// Refuses a sphere that overlaps one of those in the grid.
void BodyPlacement::checkSpheres(std::size_t body) {
  const SphereShape& shape = sphere(body);
  const double allowed = -kOverlapTolerance * shape.radius;
  const SphereGrid::Ball* hit = grid_.nearerThan(allowed, shape.position, shape.radius);
  if (hit == nullptr) return;
  const auto [first, last] = std::minmax(hit->body, body);
  const double depth = hit->radius + shape.radius - (hit->centre - shape.position).norm();
  entries_[last].fail(inQuotes(scene_.bodies[last].name) + " overlaps " +
                      inQuotes(scene_.bodies[first].name) + " by " + formatNumber(depth) +
                      " metres" + kAtTheStart + "spheres that touch at most");
}

void BodyPlacement::placeGroups() {
  for (PendingGroup& group : groups_) {
    if (!group.node.failed()) placeGroup(group);
  }
}

/// Places the spheres of a group by random sequential placement, the larger ones first because they
/// find room less easily.
void BodyPlacement::placeGroup(PendingGroup& group) {
  std::vector<std::size_t> order(group.count);
  std::iota(order.begin(), order.end(), group.firstBody);
  sortLargestFirst(order);
  for (std::size_t placed = 0; placed < order.size(); ++placed) {
    if (placeSphere(group, order[placed])) continue;
    const std::string effort = work() > kMaxPlacingWork
                                   ? "before the work on all groups grew too large"
                                   : "in " + std::to_string(kTriesPerSphere) + " tries each";
    group.node.fail("only " + std::to_string(placed) + " of " + std::to_string(group.count) +
                    " spheres found a free place between min and max " + effort +
                    "; expected fewer or smaller spheres, or more room");
    return;
  }
}

/// Draws places for a sphere until one is free; false if none is found.
bool BodyPlacement::placeSphere(PendingGroup& group, std::size_t body) {
  SphereShape& shape = sphere(body);
  const Vec3 margin = Vec3::Constant(shape.radius * (1.0 + kPlacingClearance));
  const Vec3 low = group.min + margin;
  const Vec3 high = group.max - margin;
  if ((low.array() > high.array()).any()) return false;
  for (int attempt = 0; attempt < kTriesPerSphere; ++attempt) {
    if (work() > kMaxPlacingWork) return false;
    Vec3 centre = Vec3::Zero();
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      centre[axis] = group.random.within({low[axis], high[axis]});
    }
    if (!isFree(centre, shape.radius)) continue;
    shape.position = centre;
    grid_.insert({centre, shape.radius, body});
    return true;
  }
  return false;
}

bool BodyPlacement::isFree(const Vec3& centre, double radius) {
  const double clearance = kPlacingClearance * radius;
  for (const std::size_t wall : walls_) {
    ++wallWork_;
    if (gapToWall(wall, centre, radius) < clearance) return false;
  }
  if (isInJello(centre, radius + clearance)) return false;
  return grid_.nearerThan(clearance, centre, radius) == nullptr;
}

void BodyPlacement::sortLargestFirst(std::vector<std::size_t>& spheres) const {
  std::stable_sort(spheres.begin(), spheres.end(), [this](std::size_t body, std::size_t next) {
    return sphere(body).radius > sphere(next).radius;
  });
}

bool BodyPlacement::isInJello(const Vec3& centre, double radius) {
  if (!skin_ || skinBox_.squaredExteriorDistance(centre) > radius * radius) return false;
  wallWork_ += skin_->squares().size();
  const auto& [x, y, z] = skinPlaces_;
  return skin_->meet({x.data(), y.data(), z.data()}, centre, radius).has_value();
}

double BodyPlacement::gapToWall(std::size_t wall, const Vec3& centre, double radius) const {
  const SceneBody& body = scene_.bodies[wall];
  if (const auto* plane = std::get_if<PlaneShape>(&body.shape))
    return gapAtStart(*plane, centre, radius);
  return gapAtStart(std::get<BlockShape>(body.shape), centre, radius);
}

SphereShape& BodyPlacement::sphere(std::size_t body) const {
  return std::get<SphereShape>(scene_.bodies[body].shape);
}

}  // namespace carom::scenes
