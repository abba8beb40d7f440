#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "carom/audio/vector.h"

namespace carom::plugin {

/// A body that can move, as the placement of a listener sees it: the sphere around it.
struct PlacementBody {
  Vec3 centre = Vec3::Zero();  ///< m, world frame
  double radius = 0.0;         ///< m
};

/// The sphere around what can move.
struct PlacementSphere {
  Vec3 centre = Vec3::Zero();  ///< m, world frame
  double radius = 0.0;         ///< m
};

/// The surroundings of the bodies.
struct PlacementScene {
  Vec3 up = Vec3::UnitY();  ///< unit
  /// Height (m, along `up`) of the bottom of the lowest immovable body; none: nothing is below.
  std::optional<double> lowest = std::nullopt;
  /// Returns the share of the way from the first point to the second at which something immovable
  /// is met first; 1 if nothing is.
  std::function<double(const Vec3& from, const Vec3& to)> freeShare = nullptr;
};

/// A place to listen from, and what it looks at.
struct ListenerPlacement {
  Vec3 position = Vec3::Zero();
  PlacementSphere seen;
};

/// Returns the sphere around the bodies, but for those that are no number, that have fallen out of
/// the world (below all that is immovable), or that are far from most others; none without bodies.
/// [any thread]
std::optional<PlacementSphere> sphereAround(std::span<const PlacementBody> bodies,
                                            const PlacementScene& scene);

/// Places a listener where a camera with a field of view of 50 degrees would see the whole sphere
/// from 25 degrees above, or from higher: at the first azimuth from which nothing immovable hides
/// the sphere's centre or its bodies; else where the most of the way is free, this side of what is
/// met. Never within the sphere around a body. [any thread]
ListenerPlacement placeListener(const PlacementSphere& sphere,
                                std::span<const PlacementBody> bodies, const PlacementScene& scene);

/// Returns the orientation of a listener that looks from `position` at `target`, upright.
Quat lookingAt(const Vec3& position, const Vec3& target, const Vec3& up);

}  // namespace carom::plugin
