#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "carom/audio/listener.h"
#include "carom/audio/vector.h"

namespace carom::audio {

struct PoseTrackSettings {
  std::size_t capacity = 1024;  ///< poses kept; beyond it the oldest is dropped and counted
  /// Time in s for which the last velocity goes on after the last pose; then the listener stands.
  /// It is longer than a frame, of which 60 come in a second, and so short that an application that
  /// hangs does not send its listener away.
  double horizon = 0.1;
};

/// The path of a moving listener through poses that arrive one by one.
///
/// Position: between two poses a cubic Hermite curve, whose velocity at each pose is the mean
/// velocity of the interval that ends there (at the first pose: of the interval that begins there).
/// So position and velocity are continuous, an interval is final as soon as its second pose is
/// known, and nothing waits for a later pose. Exact at constant velocity; under an acceleration a,
/// with poses every h seconds, the position is off by up to 0.048 a h^2 and the velocity by a h/2.
/// The speed on the curve is at most 5/3 of the largest mean speed between poses.
/// Orientation: slerp along the shorter arc, continuous, with a constant rate of turn in between.
/// Before the first pose the listener stands there. After the last one the position goes on with
/// the last velocity for `horizon` seconds and then stands, and the orientation stands at once: a
/// head that turns stops sooner than one that travels. A later pose replaces the extrapolated
/// motion; sound that was rendered from the extrapolation is then ahead or behind by its error,
/// a h^2 in the worst case, over the speed of sound.
///
/// Not thread safe: one thread appends and asks, or the caller orders the calls. Only the
/// constructor allocates.
class PoseTrack {
 public:
  /// A listener that stands at `pose`, at all times until a pose is appended.
  explicit PoseTrack(const ListenerPose& pose = {}, const PoseTrackSettings& settings = {});

  /// Adds the next pose. Returns false and changes nothing if it is not finite, its orientation is
  /// not of unit length, its time is not after the last one, or its speed from the last pose is
  /// above kMaxSpeed (for such a jump there is `restart`). [one thread; does not allocate]
  bool append(const ListenerPose& pose) noexcept;
  /// Discards the history: the listener stands at `pose`, at all times. Sound under way is heard at
  /// the new place. Returns false and changes nothing if the pose is not finite or its orientation
  /// not of unit length. [one thread; does not allocate]
  bool restart(const ListenerPose& pose) noexcept;
  /// Drops the poses that matter only to times before `time`; from `time` on nothing changes.
  /// [one thread; does not allocate]
  void forgetBefore(double time) noexcept;

  /// The pose at any time. [one thread; does not allocate; O(log size)]
  ListenerPose at(double time) const noexcept;

  /// The motion of a point fixed to the listener, at one time.
  struct Motion {
    Vec3 position;  ///< m, world frame
    Vec3 velocity;  ///< m/s, world frame; where it jumps, the later one
  };
  /// @param offset m, listener frame: a receiver of the listener
  /// [one thread; does not allocate; O(log size)]
  Motion motion(double time, const Vec3& offset = Vec3::Zero()) const noexcept;
  /// The orientation of `at`. [one thread; does not allocate; O(log size)]
  Quat orientation(double time) const noexcept;

  /// True if the listener stands at one pose from `time` (s) on, as far as is known.
  bool stands(double time) const { return time >= standsSince_; }
  /// True if the poses before and after `time` (s) differ, or the last two if there is none after.
  bool moves(double time) const noexcept;
  std::size_t size() const { return count_; }              ///< poses kept, at least 1
  std::uint64_t droppedPoses() const { return dropped_; }  ///< poses dropped for lack of capacity
  double lastTime() const { return knot(count_ - 1).pose.time; }  ///< s

  /// Highest mean speed in m/s between two poses. 5/3 of it, the bound on the curve, stays below
  /// the speed of sound in air.
  static constexpr double kMaxSpeed = 180.0;

 private:
  struct Knot {
    ListenerPose pose;
    Vec3 velocity = Vec3::Zero();
    Vec3 turn = Vec3::Zero();  // rad, from the orientation of the knot before
  };
  std::size_t placeOf(std::size_t index) const {
    const std::size_t place = first_ + index;
    return place < knots_.size() ? place : place - knots_.size();
  }
  const Knot& knot(std::size_t index) const { return knots_[placeOf(index)]; }
  Knot& knot(std::size_t index) { return knots_[placeOf(index)]; }
  std::size_t knotBefore(double time) const;
  Motion along(std::size_t index, double time) const;
  // The same as `motion` and `orientation`, from the knot before `time`.
  Motion motionFrom(std::size_t index, double time, const Vec3& offset) const;
  Quat orientationFrom(std::size_t index, double time) const;

  std::vector<Knot> knots_;  // a ring buffer
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  std::uint64_t dropped_ = 0;
  double horizon_ = 0.0;
  bool isFirst_ = true;  // the last pose has none before it, so its velocity is not known yet
  double standsSince_ = -std::numeric_limits<double>::infinity();  // s; infinite: it moves
};

/// The arrival at a moving receiver of a wave that leaves a source at one time and place.
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

/// The state of the source when the wave leaves it.
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
/// [one thread; does not allocate; O(log size)]
Arrival arrivalOf(const PoseTrack& track, const Emission& emission, double speedOfSound,
                  const Vec3& offset = Vec3::Zero()) noexcept;

/// Returns the time of the arrival alone, in s.
double arrivalTime(const PoseTrack& track, double emissionTime, const Vec3& sourcePosition,
                   double speedOfSound, const Vec3& offset = Vec3::Zero()) noexcept;

}  // namespace carom::audio
