#pragma once

#include <optional>
#include <unordered_map>

#include "carom/audio/result.h"
#include "carom/audio/sound_body.h"
#include "carom/audio/vector.h"
#include "carom/sound.h"
#include "plugin/bullet/shape_solver.h"

class btCollisionObject;
class btCollisionShape;

namespace carom::plugin {

/// A body of a Bullet world as it radiates, and how far its shape could be solved.
struct BodyReading {
  SoundBody sound;
  double density = 0.0;             ///< kg/m^3; 0 for a body that cannot move
  bool isLink = false;              ///< it is a link of a multibody, and can move
  std::optional<Error> unsolved{};  ///< why a movable body does not radiate by its shape
  /// Its shape, while that is not solved: the body radiates as a sphere, of its volume or then of
  /// its dipole.
  std::optional<ShapeSolver::ShapeId> pending{};
  /// As SoundBody::inverseInertia, for when the shape is solved.
  Eigen::Matrix3d inverseInertia = Eigen::Matrix3d::Zero();
};

/// Reads Bullet bodies as SoundBodies: mass and inertia as Bullet has them, added mass of their
/// shape, the material guessed from their density.
///
/// Shapes are told apart by their surfaces as they are at this moment, with scaling, and not by
/// their addresses, but between two calls of beginReading. [one thread]
class BodyReader {
 public:
  explicit BodyReader(const WorldSoundSettings& settings)
      : choice_(settings.radiators), metres_(settings.metresPerUnit), solver_(settings.recoil) {}

  /// Forgets which shape is where: a host may have changed it since.
  void beginReading() { surfaces_.clear(); }
  /// Reads a body. If its shape is the first of its kind, it will be solved, the sooner the heavier
  /// the body is and the nearer to `listener` (m).
  BodyReading read(const btCollisionObject& object, const Vec3& listener);

  ShapeSolver& solver() { return solver_; }
  const ShapeSolver& solver() const { return solver_; }

 private:
  /// The surface of a shape.
  struct Surface {
    double radius = 0.0;                       ///< m, of the sphere of its volume
    std::optional<Error> fault{};              ///< why it cannot be had
    std::optional<ShapeSolver::ShapeId> id{};  ///< if it is to be solved
  };

  const Surface& surfaceOf(const btCollisionShape& shape, bool isSolved, double urgency);
  void readShape(const btCollisionShape& shape, double urgency, BodyReading& reading);

  RadiatorChoice choice_;
  double metres_;
  std::unordered_map<const btCollisionShape*, Surface> surfaces_;
  ShapeSolver solver_;
};

}  // namespace carom::plugin
