#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <unordered_set>

#include "carom/audio/panel_radiator.h"
#include "carom/audio/result.h"
#include "carom/audio/sound_body.h"
#include "carom/sound.h"

class btCollisionObject;
class btCollisionShape;

namespace carom::plugin {

/// A body of a Bullet world as it radiates, and whether its shape could be solved.
struct BodyReading {
  SoundBody sound;
  bool isLink = false;              ///< it is a link of a multibody, and can move
  std::optional<Error> unsolved{};  ///< why a movable body does not radiate by its shape
};

/// Reads Bullet bodies as SoundBodies: mass and inertia as Bullet has them, added mass of their
/// shape, the material guessed from their density.
///
/// Shapes are told apart by their surfaces as they are at this moment, with scaling, and not by
/// their addresses. [one thread]
class BodyReader {
 public:
  explicit BodyReader(RadiatorChoice choice) : choice_(choice) {}

  /// Reads a body; solves its shape if it is the first of its kind.
  BodyReading read(const btCollisionObject& object);

  /// Number of shapes solved so far.
  std::uint64_t solved() const { return solved_.size(); }

 private:
  using Radiator = std::shared_ptr<const RigidRadiator>;

  Result<Radiator> solve(const SurfaceMesh& surface);
  void readShape(const btCollisionShape& shape, BodyReading& reading);

  RadiatorChoice choice_;
  std::shared_ptr<RadiatorCache> cache_ = std::make_shared<RadiatorCache>();
  std::unordered_set<const RigidRadiator*> solved_;  // in cache_
};

}  // namespace carom::plugin
