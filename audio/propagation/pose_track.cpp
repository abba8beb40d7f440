#include "audio/propagation/pose_track.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace carom::audio {
namespace {

constexpr double kDelayTolerance = 1e-13;  // s: a step below this ends the search
constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr int kMaxSteps = 200;  // bisection alone ends in about 100

/// Rotation vector (rad, frame of `from`) from `from` to `to`, the shorter way.
Vec3 turnBetween(const Quat& from, const Quat& to) {
  Quat turn = from.conjugate() * to;
  if (turn.w() < 0.0) turn.coeffs() = -turn.coeffs();
  const double sine = turn.vec().norm();
  if (sine == 0.0) return Vec3::Zero();
  return turn.vec() * (2.0 * std::atan2(sine, turn.w()) / sine);
}

Quat turnedBy(const Vec3& turn) {
  const double angle = turn.norm();
  if (angle == 0.0) return Quat::Identity();
  return Quat(Eigen::AngleAxisd(angle, turn / angle));
}

bool isSamePlace(const ListenerPose& a, const ListenerPose& b) {
  return a.position == b.position && a.orientation.coeffs() == b.orientation.coeffs();
}

/// The residual t - t_e - |x(t) - x_S| / c and its slope, over the delay t - t_e.
struct Residual {
  double value = 0.0;
  double slope = 1.0;
  double distance = 0.0;
};

class Wave {
 public:
  Wave(const PoseTrack& track, const Emission& emission, double speedOfSound, const Vec3& offset)
      : track_(track), emission_(emission), speedOfSound_(speedOfSound), offset_(offset) {}

  Residual at(double delay) const {
    const PoseTrack::Motion motion = track_.motion(emission_.time + delay, offset_);
    const Vec3 path = motion.position - emission_.position;
    const double distance = path.norm();
    const double recession = distance > 0.0 ? path.dot(motion.velocity) / distance : 0.0;
    return {delay - distance / speedOfSound_, 1.0 - recession / speedOfSound_, distance};
  }

  double delay() const {
    double least = 0.0;  // the residual is never positive here: nothing arrives before it leaves
    double most = at(0.0).distance / speedOfSound_;
    double delay = most;
    Residual residual = at(delay);
    Residual beyond = residual;
    for (int step = 0; step < kMaxSteps && beyond.value < 0.0; ++step) {
      most = 2.0 * most + kDelayTolerance;
      beyond = at(most);
    }
    for (int step = 0; step < kMaxSteps; ++step) {
      if (residual.value == 0.0) return delay;
      (residual.value < 0.0 ? least : most) = delay;
      double next = delay - residual.value / residual.slope;
      if (!(next >= least && next <= most)) next = least + 0.5 * (most - least);
      const double change = std::abs(next - delay);
      delay = next;
      if (change < kDelayTolerance) break;
      residual = at(delay);
    }
    return delay;
  }

 private:
  const PoseTrack& track_;
  const Emission& emission_;
  double speedOfSound_;
  const Vec3& offset_;
};

/// Delay (s) of the arrival. For a listener who stands nothing has to be searched.
double delayOf(const PoseTrack& track, const Emission& emission, double speedOfSound,
               const Vec3& offset) {
  if (!track.stands(emission.time)) return Wave(track, emission, speedOfSound, offset).delay();
  return (track.motion(emission.time, offset).position - emission.position).norm() / speedOfSound;
}

}  // namespace

PoseTrack::PoseTrack(const ListenerPose& pose, const PoseTrackSettings& settings)
    : knots_(std::max<std::size_t>(settings.capacity, 2)), horizon_(settings.horizon) {
  assert(isPose(pose) && settings.horizon >= 0.0);
  knots_[0].pose = pose;
  count_ = 1;
}

bool PoseTrack::append(const ListenerPose& pose) noexcept {
  Knot& last = knot(count_ - 1);
  if (!isPose(pose) || !(pose.time > last.pose.time)) return false;
  const Vec3 velocity = (pose.position - last.pose.position) / (pose.time - last.pose.time);
  if (!(velocity.norm() <= kMaxSpeed)) return false;
  // The curve leaves a first pose with the mean velocity to the second.
  if (isFirst_) last.velocity = velocity;
  isFirst_ = false;
  // The curve comes to rest at the second of two equal poses.
  if (!isSamePlace(pose, last.pose))
    standsSince_ = kNever;
  else if (standsSince_ == kNever)
    standsSince_ = pose.time;
  const Vec3 turn = turnBetween(last.pose.orientation, pose.orientation);
  if (count_ == knots_.size()) {
    first_ = (first_ + 1) % knots_.size();
    --count_;
    ++dropped_;
  }
  knot(count_++) = {pose, velocity, turn};
  return true;
}

bool PoseTrack::restart(const ListenerPose& pose) noexcept {
  if (!isPose(pose)) return false;
  first_ = 0;
  count_ = 1;
  isFirst_ = true;
  standsSince_ = -kNever;
  knots_[0] = {pose, Vec3::Zero(), Vec3::Zero()};
  return true;
}

void PoseTrack::forgetBefore(double time) noexcept {
  while (count_ > 1 && knot(1).pose.time <= time) {
    first_ = (first_ + 1) % knots_.size();
    --count_;
  }
}

bool PoseTrack::moves(double time) const noexcept {
  if (count_ < 2) return false;
  const std::size_t before = std::min(knotBefore(time), count_ - 2);
  return !isSamePlace(knot(before).pose, knot(before + 1).pose);
}

/// Returns the last knot at or before `time`, or the first knot if there is none.
std::size_t PoseTrack::knotBefore(double time) const {
  // It is asked for near the last knot, most often.
  std::size_t low = count_ - 1;
  std::size_t high = count_;
  for (std::size_t back = 1; low > 0 && knot(low).pose.time > time; back *= 2) {
    high = low;
    low = low > back ? low - back : 0;
  }
  while (high - low > 1) {
    const std::size_t middle = low + (high - low) / 2;
    (knot(middle).pose.time <= time ? low : high) = middle;
  }
  return low;
}

/// Evaluates the Hermite curve from knot `index` to the next.
PoseTrack::Motion PoseTrack::along(std::size_t index, double time) const {
  const Knot& from = knot(index);
  const Knot& to = knot(index + 1);
  const double span = to.pose.time - from.pose.time;
  const double s = (time - from.pose.time) / span;
  const Vec3 way = to.pose.position - from.pose.position;
  // Written around the straight line, so that a constant velocity is kept exactly.
  const Vec3 excessFrom = span * from.velocity - way;
  const Vec3 excessTo = span * to.velocity - way;
  const double rest = 1.0 - s;
  return {from.pose.position + s * way + (s * rest * rest) * excessFrom - (s * s * rest) * excessTo,
          (way + (rest * (1.0 - 3.0 * s)) * excessFrom + (s * (3.0 * s - 2.0)) * excessTo) / span};
}

ListenerPose PoseTrack::at(double time) const noexcept {
  const std::size_t index = knotBefore(time);
  return {time, motionFrom(index, time, Vec3::Zero()).position, orientationFrom(index, time)};
}

Quat PoseTrack::orientation(double time) const noexcept {
  return orientationFrom(knotBefore(time), time);
}

PoseTrack::Motion PoseTrack::motion(double time, const Vec3& offset) const noexcept {
  return motionFrom(knotBefore(time), time, offset);
}

Quat PoseTrack::orientationFrom(std::size_t index, double time) const {
  const Knot& from = knot(index);
  if (index + 1 >= count_ || !(time > from.pose.time)) return from.pose.orientation;
  const Knot& to = knot(index + 1);
  const double s = (time - from.pose.time) / (to.pose.time - from.pose.time);
  return from.pose.orientation * turnedBy(s * to.turn);
}

PoseTrack::Motion PoseTrack::motionFrom(std::size_t index, double time, const Vec3& offset) const {
  const Knot& from = knot(index);
  const double since = time - from.pose.time;
  const bool isLast = index + 1 == count_;
  Motion motion{from.pose.position, Vec3::Zero()};
  if (since >= 0.0) {
    if (!isLast)
      motion = along(index, time);
    else if (since < horizon_)
      motion = {from.pose.position + since * from.velocity, from.velocity};
    else
      motion.position += horizon_ * from.velocity;
  }
  if (offset.isZero(0.0)) return motion;
  const Vec3 arm = orientationFrom(index, time) * offset;
  motion.position += arm;
  if (since < 0.0 || isLast) return motion;
  const Knot& to = knot(index + 1);
  const Vec3 rate = from.pose.orientation * to.turn / (to.pose.time - from.pose.time);
  motion.velocity += rate.cross(arm);
  return motion;
}

Arrival arrivalOf(const PoseTrack& track, const Emission& emission, double speedOfSound,
                  const Vec3& offset) noexcept {
  assert(speedOfSound > 0.0);
  Arrival arrival;
  arrival.delay = delayOf(track, emission, speedOfSound, offset);
  arrival.time = emission.time + arrival.delay;
  const PoseTrack::Motion motion = track.motion(arrival.time, offset);
  const Vec3 path = motion.position - emission.position;
  arrival.distance = path.norm();
  arrival.orientation = track.orientation(arrival.time);
  if (arrival.distance > 0.0) arrival.towardsSource = -path / arrival.distance;
  const double sourceMach = -arrival.towardsSource.dot(emission.velocity) / speedOfSound;
  const double listenerMach = -arrival.towardsSource.dot(motion.velocity) / speedOfSound;
  arrival.stretch = (1.0 - sourceMach) / (1.0 - listenerMach);
  return arrival;
}

double arrivalTime(const PoseTrack& track, double emissionTime, const Vec3& sourcePosition,
                   double speedOfSound, const Vec3& offset) noexcept {
  const Emission emission{emissionTime, sourcePosition, Vec3::Zero()};
  return emissionTime + delayOf(track, emission, speedOfSound, offset);
}

}  // namespace carom::audio
