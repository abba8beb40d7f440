#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Geometry>

#include "modal/json/json_reader.h"
#include "native/jello/jello_skin.h"
#include "scenes/format/group_random.h"
#include "scenes/format/scene.h"
#include "scenes/format/sphere_grid.h"

namespace carom::scenes {

/// Part of each message about bodies that overlap, and of no other.
inline constexpr const char* kAtTheStart = " at the start; expected ";

/// A group of spheres whose positions are still to be found.
struct PendingGroup {
  std::size_t firstBody = 0;  ///< index in Scene::bodies; the others follow
  std::size_t count = 0;
  Vec3 min = Vec3::Zero();  ///< m, lower corner of the box that the spheres lie in
  Vec3 max = Vec3::Zero();  ///< m, upper corner
  modal::JsonNode node;     ///< entry of the group
  GroupRandom random;
};

/// Finds out where the bodies of a scene are at the start: checks that those with a position do not
/// overlap, then places groups of spheres where there is room. Solids are in nobody's way here.
/// Every error is recorded at the entry of the body in the document. [one thread]
class BodyPlacement {
 public:
  /// `scene` is borrowed; its bodies are complete but for the positions of spheres in `groups`,
  /// which are in the order of their bodies. `entries` holds the entry of each body.
  BodyPlacement(Scene& scene, std::vector<modal::JsonNode> entries,
                std::vector<PendingGroup> groups);

  /// Refuses spheres that overlap each other, a wall or the jello, and a jello that reaches into a
  /// plane.
  void checkOverlaps();

  /// Places the groups, in their order; to be called once, after checkOverlaps has found no error.
  void placeGroups();

 private:
  void addBody(std::size_t body);
  void addJello(std::size_t body, const JelloShape& jello);

  void checkJello() const;
  void checkWalls(std::size_t body) const;
  void checkSpheres(std::size_t body);

  void placeGroup(PendingGroup& group);
  bool placeSphere(PendingGroup& group, std::size_t body);
  bool isFree(const Vec3& centre, double radius);

  void sortLargestFirst(std::vector<std::size_t>& spheres) const;
  bool isInJello(const Vec3& centre, double radius);
  double gapToWall(std::size_t wall, const Vec3& centre, double radius) const;
  SphereShape& sphere(std::size_t body) const;
  std::uint64_t work() const { return grid_.work() + wallWork_; }

  Scene& scene_;
  std::vector<modal::JsonNode> entries_;  // by body
  std::vector<PendingGroup> groups_;
  std::vector<std::size_t> fixedSpheres_;          // bodies: spheres outside groups
  std::vector<std::size_t> walls_;                 // bodies: planes and blocks
  std::optional<std::size_t> jello_;               // body
  std::optional<native::JelloSkin> skin_;          // the surface of the jello
  std::array<std::vector<double>, 3> skinPlaces_;  // m, coordinates of the jello's points, by axis
  Eigen::AlignedBox3d skinBox_;                    // m, bounding box of these points
  SphereGrid grid_;
  std::uint64_t wallWork_ = 0;  // distances to walls and to squares of the jello
};

}  // namespace carom::scenes
