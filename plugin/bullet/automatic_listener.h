#pragma once

#include <optional>

#include "carom/audio/listener.h"
#include "plugin/bullet/listener_placement.h"

class btDynamicsWorld;

namespace carom::plugin {

/// The listener of a Bullet world that nobody has placed: where a camera would be.
///
/// It is placed as soon as there is something that can move. From then on it looks every kPeriod of
/// the simulation whether what can move still fits what it sees; if not, it glides to where it
/// would be placed now, at kSpeed or within kLongestGlide. A world that keeps to its place does not
/// move it. [simulation thread]
class AutomaticListener {
 public:
  static constexpr double kPeriod = 0.25;        ///< s
  static constexpr double kSpeed = 3.0;          ///< m/s, mean of a glide
  static constexpr double kShortestGlide = 1.0;  ///< s
  static constexpr double kLongestGlide = 10.0;  ///< s

  /// `metres`: of the world's unit.
  explicit AutomaticListener(double metres) : metres_(metres) {}

  /// Looks at the world at that time (s). Returns the pose (m), if it is a new one.
  std::optional<ListenerPose> update(const btDynamicsWorld& world, double time, bool isQuiet);

  /// Returns what is in view, if anything is.
  const std::optional<ListenerPlacement>& placement() const { return goal_; }

 private:
  struct Glide {
    ListenerPlacement from;
    double begin = 0.0;     // s
    double duration = 0.0;  // s
  };

  void look(const btDynamicsWorld& world, double time, bool isQuiet);
  bool isFitting(const PlacementSphere& sphere) const;
  ListenerPlacement placeAt(double time) const;

  double metres_;
  std::optional<ListenerPlacement> goal_;
  std::optional<Glide> glide_;
  Vec3 up_ = Vec3::UnitY();
  double nextLook_ = 0.0;  // s
  int objects_ = -1;       // at the latest look
  bool isNew_ = false;
};

}  // namespace carom::plugin
