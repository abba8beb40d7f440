#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "carom/audio/listener.h"
#include "carom/audio/vector.h"

namespace carom::audio {

struct PoseTrackSettings {
  std::size_t capacity = 1024;  ///< poses kept; the oldest goes for the next, counted
  /// s for which the last velocity goes on after the last pose; then the listener stands. Frames
  /// come 60 to a second; an application that hangs does not send its listener away.
  double horizon = 0.1;
};

/// The path of a moving listener through poses that arrive one by one.
///
/// Position: between two poses a cubic Hermite curve, whose velocity at each pose is the mean
/// velocity of the interval that ends there (at the first pose: of the interval that begins
/// there). So position and velocity are continuous, an interval is final as soon as its second
/// pose is known, and nothing waits for a pose to come. Exact at constant velocity; under an
/// acceleration a, with poses every h seconds, off by up to 0.048 a h^2 and the velocity by a h/2.
/// The speed on the curve is at most 5/3 of the largest mean speed between poses.
/// Orientation: slerp along the shorter arc, continuous, with a constant rate of turn in between.
/// Before the first pose it stands there. After the last one the position goes on with the last
/// velocity for `horizon` seconds and then stands, and the orientation stands at once: a head that
/// turns stops sooner than one that travels. A pose that comes later replaces what was
/// extrapolated; what had been rendered from that is then ahead or behind by the error of the
/// extrapolation, a h^2 in the worst case, over the speed of sound.
///
/// Not thread safe: one thread appends and asks, or the caller orders them. Only the constructor
/// allocates.
class PoseTrack {
 public:
  /// A listener that stands at `pose`, at all times until a pose is appended.
  explicit PoseTrack(const ListenerPose& pose = {}, const PoseTrackSettings& settings = {});

  /// Adds the next pose. False, and no change: not finite, an orientation that is not of unit
  /// length, a time not after the last one, or a speed above kMaxSpeed from the last pose (for
  /// such a jump there is `restart`). [one thread; does not allocate]
  bool append(const ListenerPose& pose) noexcept;
  /// Forgets everything: the listener stands at `pose`, and did so always. What is under way is
  /// heard at the new place. False, and no change: not finite or not of unit length.
  /// [one thread; does not allocate]
  bool restart(const ListenerPose& pose) noexcept;
  /// Forgets what only matters to times before `time`; from `time` on nothing changes.
  /// [one thread; does not allocate]
  void forgetBefore(double time) noexcept;

  /// The pose at any time. [one thread; does not allocate; O(log size)]
  ListenerPose at(double time) const noexcept;

  /// A point fixed to the listener, at one time.
  struct Motion {
    Vec3 position;  ///< m, world frame
    Vec3 velocity;  ///< m/s, world frame; where it jumps, that of what follows
  };
  /// @param offset m, listener frame: a receiver of the listener
  /// [one thread; does not allocate; O(log size)]
  Motion motion(double time, const Vec3& offset = Vec3::Zero()) const noexcept;

  std::size_t size() const { return count_; }                     ///< poses kept, at least 1
  std::uint64_t droppedPoses() const { return dropped_; }         ///< for lack of capacity
  double lastTime() const { return knot(count_ - 1).pose.time; }  ///< s

  /// m/s between two poses. 5/3 of it, the bound on the curve, stays below sound in air.
  static constexpr double kMaxSpeed = 180.0;

 private:
  struct Knot {
    ListenerPose pose;
    Vec3 velocity = Vec3::Zero();
  };
  const Knot& knot(std::size_t index) const { return knots_[(first_ + index) % knots_.size()]; }
  Knot& knot(std::size_t index) { return knots_[(first_ + index) % knots_.size()]; }
  std::size_t knotBefore(double time) const;
  Motion along(std::size_t index, double time) const;

  std::vector<Knot> knots_;  // a ring
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  std::uint64_t dropped_ = 0;
  double horizon_ = 0.0;
  bool isFirst_ = true;  // the last pose has none before it, so its velocity is not known yet
};

/// A wave that leaves a source at one time and place, as it reaches a moving receiver.
struct Arrival {
  double time = 0.0;      ///< s, simulation clock
  double delay = 0.0;     ///< s since the emission; keeps the digits that `time` rounds away
  double distance = 0.0;  ///< m from the source at emission to the receiver at arrival
  Vec3 towardsSource = Vec3::Zero();    ///< unit, world frame, at arrival; zero at no distance
  Quat orientation = Quat::Identity();  ///< of the listener at arrival
  /// d(arrival time) / d(emission time): 1 at rest, below 1 when the two approach. A tone of
  /// frequency f is heard at f / stretch; sound is stretched in time by this factor.
  double stretch = 1.0;
};

/// What the source is doing when the wave leaves it.
struct Emission {
  double time = 0.0;             ///< s, simulation clock
  Vec3 position = Vec3::Zero();  ///< m, world frame
  Vec3 velocity = Vec3::Zero();  ///< m/s, world frame; only `Arrival::stretch` depends on it
};

/// Solves t = t_e + |x(t) - x_S| / c for the arrival time t of a wave in still, uniform air, to
/// 1e-12 s in `delay` or to the rounding of `time` in x(t), by Newton steps kept in a bracket. As
/// long as the receiver is slower than sound there is one solution. When it is not (little c), one
/// of them is returned, and `stretch` can be negative (sound overtaken is heard backwards).
///
/// `stretch` = (1 - u v_S / c) / (1 - u v_L / c) with u from the source towards the receiver: the
/// Doppler effect of both (Pierce, Acoustics, chapter 9.8 for the source; here without wind).
/// @param offset m, listener frame: the receiver, see `receiversOf`
/// @param speedOfSound m/s, above 0
/// [as PoseTrack::at]
Arrival arrivalOf(const PoseTrack& track, const Emission& emission, double speedOfSound,
                  const Vec3& offset = Vec3::Zero()) noexcept;

/// The time alone, s.
double arrivalTime(const PoseTrack& track, double emissionTime, const Vec3& sourcePosition,
                   double speedOfSound, const Vec3& offset = Vec3::Zero()) noexcept;

}  // namespace carom::audio
