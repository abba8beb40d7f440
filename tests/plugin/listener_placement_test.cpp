#include "plugin/bullet/listener_placement.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

namespace carom::plugin {
namespace {

constexpr double kSinOfHalfView = 0.42261826174069944;  // sin 25 degrees

std::vector<PlacementBody> heap() {
  std::vector<PlacementBody> bodies;
  for (int x = 0; x < 4; ++x)
    for (int z = 0; z < 4; ++z)
      bodies.push_back({{0.5 * x, 0.25, 0.5 * z}, 0.3});
  return bodies;
}

/// Returns the share of a way that is free of the half-space `normal` . x < offset.
auto behindPlane(const Vec3& normal, double offset) {
  return [normal, offset](const Vec3& from, const Vec3& to) {
    const double begin = normal.dot(from) - offset;
    const double end = normal.dot(to) - offset;
    return end >= 0.0 ? 1.0 : begin / (begin - end);
  };
}

double elevationOf(const ListenerPlacement& placement) {
  const Vec3 away = placement.position - placement.seen.centre;
  return std::asin(away.y() / away.norm());
}

TEST(ListenerPlacement, SeesTheWholeSphereFrom25DegreesAbove) {
  const std::vector<PlacementBody> bodies = heap();
  const PlacementScene scene;
  const PlacementSphere sphere = *sphereAround(bodies, scene);
  EXPECT_TRUE(sphere.centre.isApprox(Vec3(0.75, 0.25, 0.75)));
  for (const PlacementBody& body : bodies)
    EXPECT_LE((body.centre - sphere.centre).norm() + body.radius, sphere.radius + 1e-12);
  const ListenerPlacement placed = placeListener(sphere, bodies, scene);
  EXPECT_NEAR((placed.position - sphere.centre).norm(), sphere.radius / kSinOfHalfView, 1e-9);
  EXPECT_NEAR(elevationOf(placed), 25.0 * std::numbers::pi / 180.0, 1e-9);
  const Quat turned = lookingAt(placed.position, sphere.centre, scene.up);
  const Vec3 ahead = turned * -Vec3::UnitZ();
  EXPECT_TRUE(ahead.isApprox((sphere.centre - placed.position).normalized(), 1e-9));
  EXPECT_NEAR((turned * Vec3::UnitX()).y(), 0.0, 1e-12);  // upright
  EXPECT_GT((turned * Vec3::UnitY()).y(), 0.0);
}

TEST(ListenerPlacement, StaysHalfAMetreFromWhatIsSmall) {
  const std::vector<PlacementBody> marble = {{{0.0, 0.0, 0.0}, 0.005}};
  const PlacementScene scene;
  const ListenerPlacement placed = placeListener(*sphereAround(marble, scene), marble, scene);
  EXPECT_NEAR(placed.position.norm(), 0.5, 1e-9);
}

TEST(ListenerPlacement, LeavesOutWhatFellOutOfTheWorldOrIsNoNumber) {
  std::vector<PlacementBody> bodies = heap();
  const PlacementSphere before = *sphereAround(bodies, {});
  bodies.push_back({{0.0, -1e6, 0.0}, 0.3});
  bodies.push_back({{std::nan(""), 0.0, 0.0}, 0.3});
  const PlacementSphere after = *sphereAround(bodies, {});
  EXPECT_EQ(after.centre, before.centre);
  EXPECT_EQ(after.radius, before.radius);
  // Neither of two bodies is far from most; but one is below the floor.
  const std::vector<PlacementBody> two = {{{0.0, 1.0, 0.0}, 0.3}, {{0.0, -1e6, 0.0}, 0.3}};
  EXPECT_TRUE(sphereAround(two, {.lowest = -2.0})->centre.isApprox(Vec3(0.0, 1.0, 0.0)));
  EXPECT_FALSE(sphereAround({}, {}));
}

TEST(ListenerPlacement, StandsInFrontOfAWall) {
  const std::vector<PlacementBody> bodies = heap();
  // The wall is 0.5 m beyond the bodies, on the side from which one looks first.
  const PlacementScene scene{.freeShare = behindPlane(-Vec3::UnitZ(), -2.3)};
  const PlacementSphere sphere = *sphereAround(bodies, scene);
  const ListenerPlacement placed = placeListener(sphere, bodies, scene);
  EXPECT_LT(placed.position.z(), 2.3);
  EXPECT_NEAR((placed.position - sphere.centre).norm(), sphere.radius / kSinOfHalfView, 1e-9);
}

// A room that is narrower than the way to the listener.
TEST(ListenerPlacement, StaysWithinANarrowRoomAndOutsideOfBodies) {
  const std::vector<PlacementBody> bodies = heap();
  const auto room = [](const Vec3& from, const Vec3& to) {
    double share = 1.0;
    for (const Vec3& wall : {Vec3(Vec3::UnitX()), Vec3(Vec3::UnitY()), Vec3(Vec3::UnitZ())}) {
      share = std::min(share, behindPlane(wall, -1.0)(from, to));
      share = std::min(share, behindPlane(-wall, -2.5)(from, to));
    }
    return share;
  };
  const PlacementScene scene{.freeShare = room};
  const ListenerPlacement placed = placeListener(*sphereAround(bodies, scene), bodies, scene);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_GT(placed.position[axis], -1.0);
    EXPECT_LT(placed.position[axis], 2.5);
  }
  for (const PlacementBody& body : bodies)
    EXPECT_GT((placed.position - body.centre).norm(), body.radius);
}

TEST(ListenerPlacement, KnowsWhereUpIs) {
  const std::vector<PlacementBody> bodies = heap();
  for (const Vec3& up :
       {Vec3(Vec3::UnitZ()), Vec3(-Vec3::UnitY()), Vec3(1.0, 1.0, 1.0).normalized()}) {
    const PlacementScene scene{.up = up};
    const ListenerPlacement placed = placeListener(*sphereAround(bodies, scene), bodies, scene);
    const Vec3 away = placed.position - placed.seen.centre;
    EXPECT_NEAR(away.dot(up) / away.norm(), kSinOfHalfView, 1e-9);
  }
}

}  // namespace
}  // namespace carom::plugin
